"use strict";
(() => {
  const root = document.documentElement;
  const remember = (value) => { try { value === undefined || localStorage.setItem("lampyris-theme", value); return localStorage.getItem("lampyris-theme"); } catch { return null; } };
  const asked = new URLSearchParams(location.search).get("theme") || remember();
  if (asked === "light" || asked === "dark") root.dataset.theme = asked;
  const system = matchMedia("(prefers-color-scheme: dark)");
  const dark = () => (root.dataset.theme || (system.matches ? "dark" : "light")) === "dark";
  const colours = () => { const s = getComputedStyle(root); return { fg: s.getPropertyValue("--fg").trim(), line: s.getPropertyValue("--line").trim(), card: s.getPropertyValue("--card").trim() }; };

  // A window of a phone: titles of axes and bars of colours beside the map would not leave room for it.
  const narrow = () => innerWidth < 560;
  const themed = (layout) => {
    const c = colours();
    layout.paper_bgcolor = layout.plot_bgcolor = "rgba(0,0,0,0)";
    // Thousands set apart as in the tables and texts, from five digits on.
    layout.separators = ".\u202f";
    layout.font = { color: c.fg, family: "system-ui, sans-serif", size: narrow() ? 11 : 13 };
    layout.hoverlabel = Object.assign(layout.hoverlabel || {}, { bgcolor: c.card, bordercolor: c.line, font: { color: c.fg } });
    for (const key of ["xaxis", "yaxis"]) if (layout[key]) Object.assign(layout[key], { gridcolor: c.line, zerolinecolor: c.line, linecolor: c.line });
    if (layout.scene) for (const key of ["xaxis", "yaxis", "zaxis"]) Object.assign(layout.scene[key], { gridcolor: c.line, color: c.fg });
    return layout;
  };

  // Remote desktops have no WebGL, where the library shows an error in place of a view: the static picture stays there.
  let webgl;
  const hasWebgl = () => {
    if (webgl !== undefined) return webgl;
    const context = document.createElement("canvas").getContext("webgl");
    webgl = !!context;
    // Browsers allow few contexts at a time.
    context?.getExtension("WEBGL_lose_context")?.loseContext();
    return webgl;
  };

  const drawn = [];
  const draw = (data) => {
    const box = document.getElementById(data.dataset.for);
    const twin = [...box.childNodes];
    const figure = JSON.parse(data.textContent);
    if (figure.layout.scene && !hasWebgl()) {
      box.parentElement.querySelector(".keys").textContent = " To turn it takes WebGL, which this browser does not have.";
      return Promise.resolve();
    }
    box.replaceChildren();
    // Paper gets the static picture: browsers print what WebGL drew as nothing, and charts as wide as the screen was.
    const printed = Object.assign(document.createElement("div"), { className: "printed" });
    printed.append(...twin);
    box.before(printed);
    figure.data.forEach(label);
    fit(box, figure);
    return Plotly.newPlot(box, figure.data, themed(figure.layout), { responsive: true, displaylogo: false, displayModeBar: false, scrollZoom: !!figure.layout.scene })
      .then(() => { drawn.push(box); box.dataset.drawn = "yes"; if (figure.layout.scene) keys(box); if (figure.data.some((trace) => trace.meta?.selectors)) pick(box); if (figure.layout.meta?.scales === "both") scales(box); box.on("plotly_relayout", () => names(box)); return names(box); })
      .catch(() => { printed.remove(); box.replaceChildren(...twin); });
  };

  // Makes room: bars of colours go above what they belong to in a narrow window, and a view grows by the rows that its legend has beyond
  // three, up to twelve; the library would take up to half of the view for them.
  const ENTRY = { width: 240, height: 20 };
  const fit = (box, { data, layout }) => {
    if (narrow()) for (const { colorbar } of data) if (colorbar) Object.assign(colorbar, { orientation: "h", y: 1, yanchor: "bottom", title: { ...colorbar.title, side: "top" } });
    // A wide map in one column leaves most of its place empty, beside a bar of colours several times its height.
    const cells = data[0]?.z?.shape?.split(",").map(Number);
    if (cells && layout.yaxis.scaleanchor && innerWidth <= 960) {
      const ratio = (cells[0] * data[0].dy) / (cells[1] * data[0].dx);
      const height = (box.clientWidth - 74) * ratio + (narrow() ? 150 : 70);
      box.style.height = `${Math.round(Math.max(220, Math.min(box.clientHeight, height)))}px`;
    }
    // Numbers of the axes stand beside the box: in a narrow window beyond the picture.
    if (layout.scene && narrow()) for (const side of ["x", "y", "z"]) layout.scene.aspectratio[side] *= 0.8;
    if (!layout.scene || !layout.showlegend) return;
    const entries = data.filter((trace) => trace.showlegend !== false).length;
    const rows = Math.ceil(entries / Math.max(1, Math.floor(box.clientWidth / ENTRY.width)));
    if (rows > 3) box.style.height = `${box.clientHeight + ENTRY.height * Math.min(rows - 3, 9)}px`;
  };

  // Each point of a mesh belongs to one face, whose selector it shows.
  const label = (trace) => {
    const faces = trace.meta?.selectors && trace.meta;
    if (!faces) return;
    const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
    trace.text = faces.first.flatMap((first, k) => Array((faces.first[k + 1] ?? faces.points) - first).fill(plain(faces.selectors[k])));
    trace.hovertemplate = "%{text}<extra>%{fullData.name}</extra>";
  };
  const pick = (box) => {
    const shown = Object.assign(document.createElement("output"), { className: "selector", textContent: "Click a face to see what names it in a rule of the scene." });
    box.after(shown);
    // What lies under the pointer is known from its last move. A press that does not turn the view is a click, even one so short that
    // no frame is drawn in it, which the library misses.
    let under = null, pressed = null;
    box.on("plotly_hover", ({ points: [point] }) => { under = point; });
    box.on("plotly_unhover", () => { under = null; });
    box.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY, under]; }, true);
    box.addEventListener("click", (event) => {
      const faces = pressed?.[2]?.data.meta;
      if (!faces?.selectors || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
      const selector = faces.selectors[faces.first.findLastIndex((first) => first <= pressed[2].pointNumber)];
      shown.textContent = selector;
      navigator.clipboard?.writeText(selector).then(() => { shown.textContent = `${selector}  (copied)`; }, () => {});
    }, true);
  };

  // A power of ten as the tables have it: thousands set apart from five digits on.
  const grouped = (value) => String(Number(value.toPrecision(3))).replace(/^\d{5,}$/, (digits) => digits.replace(/\B(?=(\d{3})+$)/g, "\u202f"));

  // Maps of light on a linear or a logarithmic scale of colours, over four decades below the peak.
  const scales = (box) => {
    const trace = box._fullData[0], linear = [...trace.z].map((row) => [...row]);
    // Cells off a disc are NaN, and one of them would be the maximum of all.
    const most = Math.max(...linear.map((row) => Math.max(0, ...row.filter(Number.isFinite))));
    if (!(most > 0)) return;
    const floor = most * 1e-4, decades = [];
    for (let e = Math.ceil(Math.log10(floor)); e <= Math.log10(most); e++) decades.push(e);
    const logarithmic = linear.map((row) => row.map((value) => Math.log10(Math.max(value, floor))));
    const { hovertemplate: hover, zmin, zmax } = box.data[0];
    const button = Object.assign(document.createElement("button"), { type: "button", className: "scale", textContent: "Logarithmic scale" });
    let log = false;
    button.addEventListener("click", () => {
      log = !log;
      button.textContent = log ? "Linear scale" : "Logarithmic scale";
      Plotly.restyle(box, { z: [log ? logarithmic : linear], zmin: log ? Math.log10(floor) : zmin, zmax: log ? Math.log10(most) : zmax, customdata: [linear], hovertemplate: [log ? hover.replace("%{z:", "%{customdata:") : hover],
        "colorbar.tickvals": [log ? decades : null], "colorbar.ticktext": [log ? decades.map((e) => grouped(10 ** e)) : null] }, [0]);
    });
    box.after(button);
  };

  // Names of points on a map, each on the first side where it covers no other and no point and stays within the map: the page's own places
  // are those of one width. Numbers of lines under a name are hidden.
  const SIDES = [[1, -1], [1, 1], [-1, -1], [-1, 1], [1, 0], [-1, 0], [0, -1], [0, 1]];
  const pen = document.createElement("canvas").getContext("2d");
  const meet = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  const names = (box) => {
    const index = box._fullData.findIndex((trace) => trace.customdata && trace.mode === "markers+text");
    if (index < 0) return undefined;
    const { xaxis, yaxis } = box._fullLayout, trace = box._fullData[index];
    pen.font = `${trace.textfont.size}px ${box._fullLayout.font.family}`;
    const half = trace.marker.size / 2 + 1, height = 1.3 * trace.textfont.size;
    const points = [...trace.x].map((x, k) => [xaxis.l2p(x), yaxis.l2p(trace.y[k])]);
    const taken = points.map(([x, y]) => ({ left: x - half, right: x + half, top: y - half, bottom: y + half }));
    const sides = points.map(([x, y], k) => {
      const width = pen.measureText(trace.customdata[k]).width;
      for (const side of SIDES) {
        const middle = [x + side[0] * (half + 2 + width / 2), y + side[1] * (half + height / 2)];
        const name = { left: middle[0] - width / 2, right: middle[0] + width / 2, top: middle[1] - height / 2, bottom: middle[1] + height / 2 };
        if (name.left < 0 || name.top < 0 || name.right > xaxis._length || name.bottom > yaxis._length || taken.some((other) => meet(name, other))) continue;
        taken.push(name);
        return side;
      }
      return null;
    });
    const written = (side) => `${["top", "middle", "bottom"][side[1] + 1]} ${["left", "center", "right"][side[0] + 1]}`;
    const text = sides.map((side, k) => side ? trace.customdata[k] : "");
    return Plotly.restyle(box, { text: [text], textposition: [sides.map((side) => written(side || SIDES[0]))] }, [index]).then(() => {
      const shown = [...box.querySelectorAll(".textpoint text")].map((name) => name.getBoundingClientRect());
      for (const number of box.querySelectorAll(".annotation")) number.style.visibility = shown.some((name) => meet(name, number.getBoundingClientRect())) ? "hidden" : "";
    });
  };

  const keys = (box) => {
    const { camera: start, aspectratio: sides } = structuredClone(box.layout.scene);
    box.addEventListener("keydown", (event) => {
      const camera = structuredClone(box._fullLayout.scene._scene.getCamera());
      const e = camera.eye;
      const far = Math.hypot(e.x, e.y, e.z), flat = Math.atan2(e.y, e.x), high = Math.asin(e.z / far);
      const put = (r, a, b) => { b = Math.max(-1.5, Math.min(1.5, b)); camera.eye = { x: r * Math.cos(b) * Math.cos(a), y: r * Math.cos(b) * Math.sin(a), z: r * Math.sin(b) }; Plotly.relayout(box, { "scene.camera": camera }); event.preventDefault(); };
      const zoom = (f) => { const s = box.layout.scene.aspectratio; Plotly.relayout(box, { "scene.aspectratio": { x: s.x * f, y: s.y * f, z: s.z * f } }); event.preventDefault(); };
      if (event.key === "ArrowLeft") put(far, flat - 0.15, high);
      else if (event.key === "ArrowRight") put(far, flat + 0.15, high);
      else if (event.key === "ArrowUp") put(far, flat, high + 0.12);
      else if (event.key === "ArrowDown") put(far, flat, high - 0.12);
      else if (event.key === "+" || event.key === "=") zoom(1.15);
      else if (event.key === "-") zoom(1 / 1.15);
      else if (event.key === "0") Plotly.relayout(box, { "scene.camera": start, "scene.aspectratio": sides });
    });
  };

  // A legend whose rows become fewer as the window widens stays over the plot until it is laid out once more.
  let settled;
  const again = (box) => box.querySelector(".legend") && Plotly.relayout(box, { "legend.y": box.layout.legend.y });
  window.addEventListener("resize", () => { clearTimeout(settled); settled = setTimeout(() => drawn.forEach((box) => { again(box); names(box); }), 400); });

  const retheme = () => { for (const box of drawn) Plotly.relayout(box, themed(structuredClone(box.layout))); };
  document.getElementById("theme").addEventListener("click", () => { root.dataset.theme = remember(dark() ? "light" : "dark") || (dark() ? "light" : "dark"); retheme(); });
  system.addEventListener("change", () => root.dataset.theme || retheme());

  for (const table of document.querySelectorAll(".table table")) {
    const heads = [...table.tHead.rows[0].cells], body = table.tBodies[0], original = [...body.rows];
    heads.forEach((head, column) => head.firstElementChild.addEventListener("click", () => {
      const now = head.getAttribute("aria-sort");
      const next = now === null ? "ascending" : now === "ascending" ? "descending" : null;
      heads.forEach((h) => h.removeAttribute("aria-sort"));
      if (next === null) return body.append(...original);
      head.setAttribute("aria-sort", next);
      const value = (row) => row.cells[column].dataset.v;
      const sign = next === "ascending" ? 1 : -1;
      body.append(...[...original].sort((a, b) => {
        const x = value(a), y = value(b);
        if (x === "" || y === "") return (x === "") - (y === "");
        const d = Number(x) - Number(y);
        return sign * (Number.isNaN(d) ? x.localeCompare(y, "en", { numeric: true }) : d);
      }));
    }));
  }
  for (const button of document.querySelectorAll("[data-copy]")) button.addEventListener("click", async () => {
    const table = document.getElementById(button.dataset.copy).querySelector("table");
    const text = [...table.rows].map((row) => [...row.cells].map((cell) => cell.dataset.v ?? cell.textContent.trim()).join("\t")).join("\n");
    try { await navigator.clipboard.writeText(text); } catch {
      const area = Object.assign(document.createElement("textarea"), { value: text });
      document.body.append(area); area.select(); document.execCommand("copy"); area.remove();
    }
    const label = button.textContent; button.textContent = "Copied"; setTimeout(() => { button.textContent = label; }, 1500);
  });

  const figures = [...document.querySelectorAll("script[data-for]")];
  figures.reduce((before, data) => before.then(() => draw(data)), Promise.resolve()).then(() => { root.dataset.ready = String(drawn.length); });
})();
