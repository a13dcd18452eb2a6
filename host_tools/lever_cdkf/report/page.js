// Draws the figures of the page with plotly.js in the colours of page.css, and keeps their time axes together.
(function () {
  "use strict";
  const root = document.documentElement;
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const touch = window.matchMedia("(pointer: coarse)").matches;
  const small = window.matchMedia("(max-width: 720px)").matches;
  const OPTIONS = {
    responsive: true, displaylogo: false, showSendToCloud: false, displayModeBar: touch || small ? false : "hover",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "zoomIn2d", "zoomOut2d", "autoScale2d"]
  };
  const charts = Array.from(document.querySelectorAll(".chart"));
  const chosen = new Map(); // chart: which of its choices
  let figures = {};
  let opened = []; // for print only

  // The text of an element, which is gzip in base64.
  async function unpacked(id) {
    const text = document.getElementById(id).textContent;
    const bytes = Uint8Array.fromBase64?.(text) ?? Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  }

  function colour(name) {
    return getComputedStyle(root).getPropertyValue("--" + name).trim();
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
      margin: { l: small ? 52 : 64, r: 12, t: 36, b: 44 },
      legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom", traceorder: "normal" },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: "@quiet", activecolor: "@text" },
      hovermode: "x unified", hoversubplots: "axis", hoverlabel: { bgcolor: "@card", bordercolor: "@edge" },
      dragmode: touch ? false : "zoom", uirevision: "kept"
    };
    const merged = Object.assign(common, own);
    for (const key of Object.keys(merged).filter((name) => /^[xy]axis/.test(name))) {
      merged[key] = Object.assign({}, axis, own[key], { title: Object.assign({}, axis.title, own[key].title) });
      if (small && key.startsWith("x") && merged[key].title.text) { // a title that is too long is folded
        merged[key].title.text = merged[key].title.text.replace(/^(?=.{36})(.{18,36}?) /, "$1<br>");
        merged[key].automargin = true;
      }
    }
    return coloured(merged);
  }

  function draw(chart) {
    const figure = figures[chart.id];
    const drawn = layout(figure);
    chart.style.height = drawn.height + "px";
    Plotly.react(chart, coloured(figure.data), drawn, OPTIONS);
    if (chosen.has(chart)) { choose(chart, chosen.get(chart)); }
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

  // A click on the legend hides or shows all curves of that name: one in each row.
  function listen(chart) {
    chart.on("plotly_legendclick", ({ curveNumber }) => {
      const { name, visible } = chart.data[curveNumber];
      const all = [...chart.data.keys()].filter((index) => chart.data[index].name === name);
      Plotly.restyle(chart, { visible: visible === "legendonly" || "legendonly" }, all);
      return false;
    });
    chart.on("plotly_legenddoubleclick", () => false);
  }

  // --- a chart that shows one of several: buttons, or a slider ---

  function choose(chart, index) {
    const choice = figures[chart.id].choices.of[index];
    chosen.set(chart, index);
    return Plotly.update(chart, choice.data, choice.layout || {}, choice.traces);
  }

  function make(tag, properties, ...children) {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  }

  function addControls(chart) {
    const choices = figures[chart.id].choices;
    if (!choices) { return; }
    chart.before(choices.slider ? slider(chart, choices) : buttons(chart, choices));
  }

  function slider(chart, choices) {
    const place = make("output", { textContent: choices.of[choices.first].label });
    const range = make("input", { type: "range", min: 0, max: choices.of.length - 1, value: choices.first });
    range.addEventListener("input", () => {
      place.textContent = choices.of[range.value].label;
      choose(chart, Number(range.value));
    });
    return make("label", { className: "slider" }, choices.slider, range, place);
  }

  function buttons(chart, choices) {
    const all = choices.of.map((choice, index) => {
      const button = make("button", { type: "button", textContent: choice.label, ariaPressed: index === choices.first });
      button.addEventListener("click", () => {
        all.forEach((other) => { other.ariaPressed = other === button; });
        choose(chart, index);
      });
      return button;
    });
    return make("div", { className: "buttons" }, ...all);
  }

  // --- on paper ---

  function print(begins) {
    root.classList.toggle("paper", begins);
    if (begins) { opened = Array.from(document.querySelectorAll("details:not([open])")); }
    opened.forEach((each) => { each.open = begins; });
    for (const table of document.querySelectorAll("table")) { // one that is too wide for the paper becomes smaller
      table.style.zoom = begins ? Math.min(1, table.parentElement.clientWidth / table.offsetWidth) : "";
    }
    charts.forEach(draw);
  }

  // --- the start ---

  async function start() {
    figures = JSON.parse(await unpacked("figures"));
    charts.forEach(addControls);
    const hint = "//# allFunctionsCalledOnLoad\n"; // for V8, which else would parse it all twice
    document.body.append(make("script", { textContent: hint + await unpacked("plotly") }));
    for (const chart of charts) {
      draw(chart);
      if (chart === charts[0]) { await new Promise((seen) => setTimeout(seen)); }
    }
    charts.forEach(listen);
    link();
    dark.addEventListener("change", () => charts.forEach(draw));
    window.addEventListener("beforeprint", () => print(true));
    window.addEventListener("afterprint", () => print(false));
  }

  root.classList.toggle("picture", window.location.hash === "#picture");
  // An open frame keeps the page loading, so that what prints or photographs it after it has loaded finds the charts.
  const hold = document.body.appendChild(make("iframe", { hidden: true }));
  hold.contentDocument.open();
  start().finally(() => {
    hold.contentDocument.close();
    hold.remove();
  });
})();
