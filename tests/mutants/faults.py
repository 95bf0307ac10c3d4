"""The deliberate faults that `run.py` tries: (name, file, text with «what is replaced», replacement, areas that ought to notice)."""

EXACT, OCTREE, PROOF, KERNEL = "src/intersect/exact/", "src/intersect/octree/", "src/tessellate/proof/", "src/simulate/kernel/"
# Areas of faults of the exact spline, quick tests first.
SPLINE = "exact:closed_forms+certificates+audit study:stability::exact_spline exact:hostile exact"
FACETS = "intersect:facets+horizon study:stability::octree_of_facets intersect"
OWN = "if «query.departure.is_some_and(|own| own.is_same_point(leaf, local, t, &self.geometry))» {"

FAULTS = [
    # The certified core: what a certificate promises.
    ("own point found again", EXACT + "acceptance.rs", OWN, "false", SPLINE + " simulate"),
    ("own point accepted within 1e-3 mm", EXACT + "acceptance.rs", OWN, "query.departure.is_some() && t.abs() < 1e-3", SPLINE + " simulate"),
    ("any root is the own one", EXACT + "query.rs", "«self.off <= self.tolerance || t.abs() <= NEAR_DEPARTURE * self.off»", "true", SPLINE + " simulate"),
    ("own point told by 1e-3 mm", EXACT + "query.rs", "«self.off <= self.tolerance || t.abs() <= NEAR_DEPARTURE * self.off»", "t.abs() <= 1e-3", SPLINE + " simulate"),
    ("trims forgotten at the border", EXACT + "acceptance.rs", "            if «!inside» {", "false", SPLINE),
    ("trims forgotten in cells", EXACT + "acceptance.rs", "return («decided == Region::Inside», false)", "true", SPLINE),
    ("rejections at trims not told", EXACT + "acceptance.rs", "if «near» {\n                    query.reject", "false", SPLINE),
    ("edges do not decide", EXACT + "acceptance.rs", "Some(inside) => «inside»,", "place.inside", SPLINE),
    ("two roots taken for one", EXACT + "leaf_test.rs", "row_u < «UNIQUE» && row_v", "3.0", SPLINE),
    ("rounding margin dropped", EXACT + "leaf_test.rs", "let margin = «PARAMETER_ROUNDING + noise * (y00.abs() + y01.abs() + y10.abs() + y11.abs())»;", "0.0", SPLINE),
    ("Krawczyk radius forgotten", EXACT + "leaf_test.rs", "* (1.0 + «row_u» + INVERSE_ROUNDING) + margin", "0.0", SPLINE),
    ("Krawczyk reach a third", EXACT + "leaf_test.rs", "let reach_v = «f64::from(leaf.half[1]) * (1.0 + row_v + INVERSE_ROUNDING) + margin»;",
     "(f64::from(leaf.half[1]) * (1.0 + row_v + INVERSE_ROUNDING) + margin) / 3.0", SPLINE),
    ("large margins not clipped", EXACT + "leaf_test.rs", "margin < «LARGEST_MARGIN»", "f64::INFINITY", SPLINE),
    ("singular nets preconditioned", EXACT + "clip_hull.rs", "let blur = if «regular» {", "true", "lib:clip_hull " + SPLINE),
    ("one root of a tangency forgotten", EXACT + "tangency.rs", "for side in «[-1.0, 1.0]» {", "[1.0, 1.0]", SPLINE),
    ("a tangency is none", EXACT + "tangency.rs", "if «height + slope * way + 0.5 * least * way * way > rounding» {", "true", SPLINE),
    ("roots counted far beside the leaf", EXACT + "leaf_test.rs", "let e = «margin + 2.0 * NEWTON_STEP»;", "margin + 0.05", SPLINE),
    ("range not asked of a root", EXACT + "acceptance.rs", "if «!query.is_in_range(t)» {", "false", SPLINE),
    ("oriented box shrunk", EXACT + "leaf_test.rs", "let (a, b) = «((leaf.olo[k] - noise - o) * inv, (leaf.ohi[k] + noise - o) * inv)»;",
     "((leaf.olo[k] + 1e-3 - o) * inv, (leaf.ohi[k] - 1e-3 - o) * inv)", SPLINE),
    ("oriented box without rounding", EXACT + "leaf_test.rs", "let (a, b) = «((leaf.olo[k] - noise - o) * inv, (leaf.ohi[k] + noise - o) * inv)»;",
     "((leaf.olo[k] - o) * inv, (leaf.ohi[k] - o) * inv)", SPLINE),
    ("leaf boxes unpadded", EXACT + "leaf.rs", "let pad = «slop + PLACED_ROUNDING * ROUND * (center.abs().max_element() + radius)»;", "0.0", SPLINE),
    ("leaf boxes shrunk", EXACT + "leaf.rs", "let pad = «slop + PLACED_ROUNDING * ROUND * (center.abs().max_element() + radius)»;", "-1e-3 * radius", SPLINE),
    ("derivative boxes a third", EXACT + "linearization.rs", "middle[c], «slopes.ru[c] + slopes.rv[c]»]", "(slopes.ru[c] + slopes.rv[c]) / 3.0", SPLINE),
    ("hierarchy not rounded outward", EXACT + "slabs.rs", "let slack = «4.0 * f64::EPSILON * (reach + near.abs())»;", "-1e-5 * reach", SPLINE),
    ("doubt forgotten at a hit", EXACT + "answer.rs", "let certainty = if «query.undecided_from <= root.t» {", "false", SPLINE),
    ("doubt forgotten at a miss", EXACT + "answer.rs", "let undecided = «query.undecided_from < f64::INFINITY»;", "false", SPLINE),
    ("doubt forgotten in a passage", EXACT + "answer.rs", "if «hit.t >= query.undecided_from» {", "false", SPLINE),
    ("doubt forgotten when the budget ends", EXACT + "clip.rs", "query.undecided_from = «query.undecided_from.min(node.near)»;", "query.undecided_from", SPLINE),
    ("normal swapped", EXACT + "answer.rs", "let normal = «label.sign» * regular", "-label.sign", SPLINE),
    ("normals at poles as elsewhere", EXACT + "answer.rs", "let regular = if label.ill_scaled { None } else { «patch::regular_normal(&jet, label.rounding)» };",
     "patch::regular_normal(&jet, 0.0)", SPLINE),
    ("clipping takes two roots for one", EXACT + "clip.rs", "y.deviation < «UNIQUE» &&", "3.0", SPLINE),
    ("clipping drops its slack", EXACT + "clip.rs", "keep[k] = «[keep[k][0] - y.slack[k], keep[k][1] + y.slack[k]]»;", "[keep[k][0] + 1e-6, keep[k][1] - 1e-6]", SPLINE),
    ("clipping drops boxes before the start", EXACT + "clip.rs", "hull.far < «query.t_min - TANGENT»", "query.t_min + 1.0", SPLINE),
    ("clipping prefers the later box", EXACT + "clip.rs", "if «node.near >= query.t_max» && query.best.is_some() {", "node.near >= query.t_max * 0.5", SPLINE),
    ("weight forgotten", EXACT + "clip.rs", "let s = net::evaluate_inlined(&node.net, degree, u, v).s;\n        let t = «s[2] / s[3]»;", "s[2]", SPLINE),
    ("contacts told as certified", EXACT + "clip.rs", "if regular && sine < TANGENT_SINE { «Certainty::Tangent» }", "Certainty::Certified", SPLINE),
    # Settling in 32 digits.
    ("open roots not settled", EXACT + "leaf_test.rs", "let open = leaf.ill_scaled || «settlement::needs_settling([u, v], margins)»;", "false", SPLINE),
    ("settled roots count beyond the face", EXACT + "settlement.rs", "if «!sides.iter().any(|&(k, end)| is_over(k, end))» {", "true", SPLINE),
    ("settled roots of another root kept", EXACT + "settlement.rs", "settled.filter(|root| «near(leaf.leaf_parameters(root.local))»)", "true", "lib:settlement " + SPLINE),
    ("unsettled roots told as certified", EXACT + "settlement.rs", "Candidate { certainty: «Certainty::Uncertified», ..found }", "Certainty::Certified", SPLINE),
    # Polishing.
    ("polish accepts a point off the ray", EXACT + "newton.rs", "if «residual > near + rounding» {", "residual > 1e-2", SPLINE),
    ("polish forgets how a face is turned", EXACT + "newton.rs", "let normal = «record.sign» * patch::normal", "1.0", SPLINE + " simulate"),
    ("polish forgets seams", EXACT + "newton.rs", "uv[k] = if «grid.closed[k]» && uv[k]", "false", SPLINE),
    # Facets and the octree: starts, rounding, boxes, sieve.
    ("the triangle that a ray leaves forgotten", "src/intersect/start_triangle.rs", "«named.map_or_else(|| is_over_second(corners, start), |triangle| triangle == QuadHalf::Second)»",
     "is_over_second(corners, start)", "intersect"),
    ("starts on borders not moved", "src/intersect/start_triangle.rs", "«start + ((self.middle - start) * NUDGE).clamp_length_max(LONGEST_NUDGE * reach)»", "start", "intersect"),
    ("grazing starts not lifted", "src/intersect/facet.rs", "«Ray { origin: ray.origin + up * (wanted - height), ..*ray }»", "*ray", "intersect"),
    ("zero edge functions not decided exactly", "src/intersect/facet.rs", "let edges = if «edges.contains(&0.0)» {", "false", "intersect"),
    ("box not rounded down", OCTREE + "clip.rs", "if «f64::from(y) > x» { y.next_down()", "false", FACETS + " lib:octree"),
    ("box not rounded up", OCTREE + "clip.rs", "if «f64::from(y) < x» { y.next_up()", "false", FACETS + " lib:octree"),
    ("boxes shrunk", OCTREE + "clip.rs", "round_down(«low[a] - pad»)", "low[a] + 0.01 * (high[a] - low[a])", FACETS),
    ("second triangle of a facet left out", OCTREE + "clip.rs", "«if c == d { 1 } else { 2 }»", "1", FACETS),
    ("node bound to nearest below", OCTREE + "node.rs", "let low = «(f64::from(bounds.low[a]) - origin) / step»;", "((f64::from(bounds.low[a]) - origin) / step).round()", FACETS),
    ("node bound to nearest above", OCTREE + "node.rs", "let high = «(f64::from(bounds.high[a]) - origin) / step»;", "((f64::from(bounds.high[a]) - origin) / step).round()", FACETS),
    ("steps too short", OCTREE + "node.rs", "/ 254.0 * «STEP_ROOM») as f32", "(1.0 - 1e-3)", FACETS),
    ("box slack dropped", OCTREE + "ray_state.rs", "b.slack[a] = «((4.0 * o.abs() + mesh_box.reach[a]) * ROUNDING + moved) * inverse.abs()»;", "0.0", FACETS),
    ("sieve slack dropped", OCTREE + "ray_state.rs", "self.sieve.slack = «moved»;", "0.0", FACETS),
    # The proof of facets.
    ("Taylor bound a third", PROOF + "deviation.rs", "/ («8.0» * lightest))", "24.0", "tessellate lib:proof"),
    ("mixed derivative forgotten", PROOF + "deviation.rs", "(most[0] + «2.0 * most[1]» + most[2])", "0.0", "tessellate lib:proof"),
    ("lightest weight forgotten", PROOF + "deviation.rs", "lightest = lightest.min(«w_min»);", "w_max", "lib:proof tessellate"),
    ("height of the quad forgotten", PROOF + "flat_quad.rs", "let flat = sides - «quad.height»;", "0.0", "tessellate lib:proof"),
    ("limit of the quad thrice", PROOF + "flat_quad.rs", "let sides = «limit * quad.cosine» - self.margin;", "3.0 * limit", "tessellate lib:proof"),
    # Tallies.
    ("squares of other replicates forgotten", "src/simulate/tally.rs", "self.squares = self.squares.saturating_add(«o.squares»);", "0", "lib:tally simulate cli"),
    ("rounding of quanta downward", "src/simulate/tally.rs", "{ «(x + SHIFT) - SHIFT» } else", "x.floor()", "lib:tally simulate"),
    ("a waiting cell is lost", "src/simulate/grid.rs", "pub(crate) fn flush(&mut self, sums: &mut [Sum]) {\n        «self.add_pending();»", "", "lib:grid simulate"),
    ("error without its correction", "src/math/spread.rs", "residuals * «n» / (n - 1.0)", "(n - 1.0)", "lib:spread+tally simulate"),
    # Contacts.
    ("partner looks the same way", KERNEL + "contact.rs", "other.body != at.face.body && opposite && «against»", "!against", "simulate:of_two_coatings simulate"),
    ("coating of the wrong face", KERNEL + "contact.rs", "[false, false] if «entering» => ContactSurface::Partner(partner),", "!entering", "simulate:contacts simulate"),
    ("coating of a partner forgotten", KERNEL + "contact.rs", "[true, false] => «ContactSurface::Partner(partner)»,", "ContactSurface::Bare", "simulate:contacts simulate"),
    ("rounding of places a thousandth", KERNEL + "tolerances.rs", "«ROUNDING_MM + ROUNDING_SHARE * distance»", "1e-3 * (ROUNDING_MM + ROUNDING_SHARE * distance)", "simulate:laid simulate"),
    ("what a ray leaves forgotten", KERNEL + "step.rs", "let mut next = «Ray::new(at.point, direction).with_departure(at.departure())»;", "Ray::new(at.point, direction)", "simulate:closed simulate"),
    # Optics.
    ("mirror image of the wrong length", "src/optics/refraction.rs", "unit(d - n * («2.0» * d.dot(n)))", "1.999", "lib:refraction simulate"),
    ("total reflection misjudged", "src/optics/refraction.rs", "(sin2_t < «1.0»).then(", "0.999", "lib:refraction simulate"),
]

# Faults that no test can see, with the reason.
EQUIVALENT = {}
