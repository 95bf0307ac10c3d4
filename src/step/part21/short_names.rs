//! The short names of entities, as some writers give them in place of the long ones: `ADVFC` for `ADVANCED_FACE`.
//!
//! Source: ISO 10303-21:2016, 7.3.4 (either may stand), and the annexes of short names of ISO 10303-41, -42, -43, -44, -46 and -203. Only
//! names that the reader asks for, whole or by their ends, are listed.

use super::span::Span;

/// The longest short name.
const LONGEST: usize = 6;

/// The name of a record as the file writes it, and the long name that a short one stands for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Keyword {
    /// Where it stands.
    pub(super) start: u32,
    /// Longer names than 65,535 bytes are no entity's, and are cut.
    len: u16,
    /// Its place in [`LONG_NAMES`], for a short one.
    short: Option<u8>,
}

impl Keyword {
    /// Returns the keyword in a span of the source.
    pub(super) fn new(source: &[u8], span: Span) -> Self {
        let written = &source[span.range()];
        let place = || LONG_NAMES.binary_search_by(|(short, _)| short.as_bytes().cmp(written)).ok();
        let short = if written.len() <= LONGEST { place() } else { None };
        Self {
            start: span.start,
            len: u16::try_from(span.len).unwrap_or(u16::MAX),
            short: short.and_then(|k| u8::try_from(k).ok()),
        }
    }

    /// Returns the long name of the entity.
    pub(super) fn bytes(self, source: &[u8]) -> &[u8] {
        match self.short {
            Some(k) => LONG_NAMES[usize::from(k)].1.as_bytes(),
            None => &source[self.start as usize..][..usize::from(self.len)],
        }
    }
}

/// Short and long names, in the order of the short ones.
const LONG_NAMES: [(&str, &str); 149] = [
    ("A2PL2D", "AXIS2_PLACEMENT_2D"),
    ("A2PL3D", "AXIS2_PLACEMENT_3D"),
    ("ABSR", "ADVANCED_BREP_SHAPE_REPRESENTATION"),
    ("ADVFC", "ADVANCED_FACE"),
    ("ASCMUS", "ASSEMBLY_COMPONENT_USAGE"),
    ("AX1PLC", "AXIS1_PLACEMENT"),
    ("BLNRSL", "BOOLEAN_RESULT"),
    ("BNDCR", "BOUNDARY_CURVE"),
    ("BNDSRF", "BOUNDED_SURFACE"),
    ("BRWTVD", "BREP_WITH_VOIDS"),
    ("BSCWK", "B_SPLINE_CURVE_WITH_KNOTS"),
    ("BSPCR", "B_SPLINE_CURVE"),
    ("BSPSR", "B_SPLINE_SURFACE"),
    ("BSSWK", "B_SPLINE_SURFACE_WITH_KNOTS"),
    ("BZRCRV", "BEZIER_CURVE"),
    ("BZRSRF", "BEZIER_SURFACE"),
    ("CCOS", "COMPOSITE_CURVE_ON_SURFACE"),
    ("CDSR", "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"),
    ("CLRRGB", "COLOUR_RGB"),
    ("CLSSHL", "CLOSED_SHELL"),
    ("CMCRSG", "COMPOSITE_CURVE_SEGMENT"),
    ("CMPCRV", "COMPOSITE_CURVE"),
    ("CMS0", "COMPOUND_SHAPE_REPRESENTATION"),
    ("CNBSUN", "CONVERSION_BASED_UNIT"),
    ("CNCSRF", "CONICAL_SURFACE"),
    ("CNFCST", "CONNECTED_FACE_SET"),
    ("CRBNSR", "CURVE_BOUNDED_SURFACE"),
    ("CRTPNT", "CARTESIAN_POINT"),
    ("CRTROP", "CARTESIAN_TRANSFORMATION_OPERATOR"),
    ("CRVRPL", "CURVE_REPLICA"),
    ("CRVSTY", "CURVE_STYLE"),
    ("CSGSLD", "CSG_SOLID"),
    ("CSSHRP", "CSG_SHAPE_REPRESENTATION"),
    ("CTO3", "CARTESIAN_TRANSFORMATION_OPERATOR_3D"),
    ("CYLSRF", "CYLINDRICAL_SURFACE"),
    ("DCMFL", "DOCUMENT_FILE"),
    ("DGTRSR", "DEGENERATE_TOROIDAL_SURFACE"),
    ("DPDC", "DRAUGHTING_PRE_DEFINED_COLOUR"),
    ("DRCTN", "DIRECTION"),
    ("DRGMDL", "DRAUGHTING_MODEL"),
    ("EBWSR", "EDGE_BASED_WIREFRAME_SHAPE_REPRESENTATION"),
    ("EDGCRV", "EDGE_CURVE"),
    ("EDGLP", "EDGE_LOOP"),
    ("ELLPS", "ELLIPSE"),
    ("ELMSRF", "ELEMENTARY_SURFACE"),
    ("EXARSL", "EXTRUDED_AREA_SOLID"),
    ("EXFCSL", "EXTRUDED_FACE_SOLID"),
    ("FBSR", "FACETED_BREP_SHAPE_REPRESENTATION"),
    ("FCBND", "FACE_BOUND"),
    ("FCOTBN", "FACE_OUTER_BOUND"),
    ("FCSRF", "FACE_SURFACE"),
    ("FCTBR", "FACETED_BREP"),
    ("GBSSR", "GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION"),
    ("GBWSR", "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION"),
    ("GC", "GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT"),
    ("GMTST", "GEOMETRIC_SET"),
    ("GUAC", "GLOBAL_UNIT_ASSIGNED_CONTEXT"),
    ("HLSPSL", "HALF_SPACE_SOLID"),
    ("HYPRBL", "HYPERBOLA"),
    ("INTCRV", "INTERSECTION_CURVE"),
    ("ITDFTR", "ITEM_DEFINED_TRANSFORMATION"),
    ("LNGUNT", "LENGTH_UNIT"),
    ("MDGPA", "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_AREA"),
    ("MDGPR", "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION"),
    ("MNSLBR", "MANIFOLD_SOLID_BREP"),
    ("MPPITM", "MAPPED_ITEM"),
    ("MSSR", "MANIFOLD_SURFACE_SHAPE_REPRESENTATION"),
    ("MSWTUN", "MEASURE_WITH_UNIT"),
    ("NAUO", "NEXT_ASSEMBLY_USAGE_OCCURRENCE"),
    ("NMSSR", "NON_MANIFOLD_SURFACE_SHAPE_REPRESENTATION"),
    ("OFCR3D", "OFFSET_CURVE_3D"),
    ("OFFSRF", "OFFSET_SURFACE"),
    ("OPNSHL", "OPEN_SHELL"),
    ("ORCLSH", "ORIENTED_CLOSED_SHELL"),
    ("ORNEDG", "ORIENTED_EDGE"),
    ("ORNFC", "ORIENTED_FACE"),
    ("ORNSRF", "ORIENTED_SURFACE"),
    ("OROPSH", "ORIENTED_OPEN_SHELL"),
    ("ORSI", "OVER_RIDING_STYLED_ITEM"),
    ("OTBNCR", "OUTER_BOUNDARY_CURVE"),
    ("PDFR", "PRODUCT_DEFINITION_FORMATION_RELATIONSHIP"),
    ("PDFWSS", "PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE"),
    ("PDWAD", "PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS"),
    ("PLANUN", "PLANE_ANGLE_UNIT"),
    ("PLCMNT", "PLACEMENT"),
    ("PLYLN", "POLYLINE"),
    ("PLYLP", "POLY_LOOP"),
    ("PNONSR", "POINT_ON_SURFACE"),
    ("PNTSTY", "POINT_STYLE"),
    ("PRBL", "PARABOLA"),
    ("PRDCT", "PRODUCT"),
    ("PRDDFN", "PRODUCT_DEFINITION"),
    ("PRDFCN", "PRODUCT_DEFINITION_CONTEXT"),
    ("PRDFEF", "PRODUCT_DEFINITION_EFFECTIVITY"),
    ("PRDFFR", "PRODUCT_DEFINITION_FORMATION"),
    ("PRDFRL", "PRODUCT_DEFINITION_RELATIONSHIP"),
    ("PRDFSH", "PRODUCT_DEFINITION_SHAPE"),
    ("PRDFUS", "PRODUCT_DEFINITION_USAGE"),
    ("PRLYAS", "PRESENTATION_LAYER_ASSIGNMENT"),
    ("PRPDFN", "PROPERTY_DEFINITION"),
    ("PRSAR", "PRESENTATION_AREA"),
    ("PRSRPR", "PRESENTATION_REPRESENTATION"),
    ("PRSST", "PRESENTATION_SET"),
    ("PRSSZ", "PRESENTATION_SIZE"),
    ("PRSTAS", "PRESENTATION_STYLE_ASSIGNMENT"),
    ("PRSVW", "PRESENTATION_VIEW"),
    ("PRUSOC", "PROMISSORY_USAGE_OCCURRENCE"),
    ("PSBC", "PRESENTATION_STYLE_BY_CONTEXT"),
    ("QACU", "QUANTIFIED_ASSEMBLY_COMPONENT_USAGE"),
    ("QSUNCR", "QUASI_UNIFORM_CURVE"),
    ("QSUNSR", "QUASI_UNIFORM_SURFACE"),
    ("RBSC", "RATIONAL_B_SPLINE_CURVE"),
    ("RBSS", "RATIONAL_B_SPLINE_SURFACE"),
    ("RCCMSR", "RECTANGULAR_COMPOSITE_SURFACE"),
    ("RCTRSR", "RECTANGULAR_TRIMMED_SURFACE"),
    ("RGANWD", "RIGHT_ANGULAR_WEDGE"),
    ("RGCRCN", "RIGHT_CIRCULAR_CONE"),
    ("RGCRCY", "RIGHT_CIRCULAR_CYLINDER"),
    ("RPRITM", "REPRESENTATION_ITEM"),
    ("RPRMP", "REPRESENTATION_MAP"),
    ("RPRRLT", "REPRESENTATION_RELATIONSHIP"),
    ("RPRSNT", "REPRESENTATION"),
    ("RRWT", "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION"),
    ("RVARSL", "REVOLVED_AREA_SOLID"),
    ("RVFCSL", "REVOLVED_FACE_SOLID"),
    ("SBDG", "SUBEDGE"),
    ("SBFC", "SUBFACE"),
    ("SBSM", "SHELL_BASED_SURFACE_MODEL"),
    ("SHDFRP", "SHAPE_DEFINITION_REPRESENTATION"),
    ("SHPRPR", "SHAPE_REPRESENTATION"),
    ("SHRPRL", "SHAPE_REPRESENTATION_RELATIONSHIP"),
    ("SHUO", "SPECIFIED_HIGHER_USAGE_OCCURRENCE"),
    ("SL", "SURFACE_OF_LINEAR_EXTRUSION"),
    ("SLDRPL", "SOLID_REPLICA"),
    ("SMCRV", "SEAM_CURVE"),
    ("SPHSRF", "SPHERICAL_SURFACE"),
    ("SRFC", "SURFACE"),
    ("SRFCRV", "SURFACE_CURVE"),
    ("SROFRV", "SURFACE_OF_REVOLUTION"),
    ("STYITM", "STYLED_ITEM"),
    ("SUNT", "SI_UNIT"),
    ("SWPSRF", "SWEPT_SURFACE"),
    ("TRDSRF", "TOROIDAL_SURFACE"),
    ("TRMCRV", "TRIMMED_CURVE"),
    ("TXTSTY", "TEXT_STYLE"),
    ("UNFCRV", "UNIFORM_CURVE"),
    ("UNFSRF", "UNIFORM_SURFACE"),
    ("VRTLP", "VERTEX_LOOP"),
    ("VRTPNT", "VERTEX_POINT"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_names_are_sorted_and_found() {
        assert!(LONG_NAMES.is_sorted_by(|a, b| a.0 < b.0) && LONG_NAMES.len() <= 256);
        assert!(LONG_NAMES.iter().all(|(short, _)| short.len() <= LONGEST));
        for (written, name) in [("CRTPNT", "CARTESIAN_POINT"), ("PLANE", "PLANE"), ("ADVFCX", "ADVFCX")] {
            let span = Span { start: 0, len: written.len() as u32 };
            assert_eq!(Keyword::new(written.as_bytes(), span).bytes(written.as_bytes()), name.as_bytes());
        }
    }
}
