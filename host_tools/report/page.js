// Draws the figures of the page with plotly.js in the colours of page.css, and keeps their time axes together.
(function () {
  "use strict";
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const touch = window.matchMedia("(pointer: coarse)").matches;
  const small = window.matchMedia("(max-width: 720px)").matches;
  const OPTIONS = {
    responsive: true, displaylogo: false, showSendToCloud: false, displayModeBar: touch || small ? false : "hover",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "zoomIn2d", "zoomOut2d", "autoScale2d"]
  };
  const charts = Array.from(document.querySelectorAll(".chart"));

  function colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  }

  // A copy of a figure in which every "@name" is the colour of that name.
  function coloured(node) {
    if (typeof node === "string") { return node.startsWith("@") ? colour(node.slice(1)) : node; }
    if (Array.isArray(node)) { return node.map(coloured); }
    if (node === null || typeof node !== "object") { return node; }
    return Object.fromEntries(Object.entries(node).map(([key, value]) => [key, coloured(value)]));
  }

  function layout(figure) {
    const axis = { gridcolor: "@grid", zerolinecolor: "@grid", linecolor: "@grid", title: { standoff: 6 } };
    const own = figure.layout;
    const common = {
      autosize: true, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "inherit", size: small ? 11 : 12, color: "@text" },
      margin: { l: small ? 52 : 64, r: 12, t: 44, b: 44 },
      legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom", yref: "paper" },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: "@quiet", activecolor: "@text" },
      hovermode: "x unified", hoversubplots: "axis", hoverlabel: { bgcolor: "@card", bordercolor: "@edge" },
      dragmode: touch ? false : "zoom"
    };
    const merged = Object.assign(common, own);
    for (const key of Object.keys(merged).filter((name) => /^[xy]axis/.test(name))) {
      merged[key] = Object.assign({}, axis, own[key], { title: Object.assign({}, axis.title, own[key].title) });
    }
    if (own.updatemenus) { merged.margin = Object.assign({}, merged.margin, { t: 90 }); }
    return coloured(merged);
  }

  function draw() {
    return Promise.all(charts.map((chart) => {
      const figure = figures[chart.id];
      return Plotly.react(chart, coloured(figure.data), layout(figure), OPTIONS);
    }));
  }

  // Zooming one figure over time zooms them all.
  function link() {
    const linked = charts.filter((chart) => figures[chart.id].over_time);
    let busy = false;
    linked.forEach((chart) => chart.on("plotly_relayout", (event) => {
      const zoomed = "xaxis.range[0]" in event || "xaxis.range" in event || "xaxis.autorange" in event;
      if (busy || !zoomed) { return; }
      busy = true;
      const range = chart.layout.xaxis.range.slice();
      const others = linked.filter((other) => other !== chart);
      Promise.all(others.map((other) => Plotly.relayout(other, { "xaxis.range": range }))).then(() => { busy = false; });
    }));
  }

  document.documentElement.classList.toggle("picture", window.location.hash === "#picture");
  draw().then(link);
  dark.addEventListener("change", draw);
})();
