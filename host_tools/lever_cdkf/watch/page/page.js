// The page: what the server tells by the WebSocket is kept in `story` and drawn; what the user asks for goes back.

import { drawBand, drawBode, drawMap, drawOther, forgetRanges } from "./charts.js";

const PATIENCE = 1500; // [ms] without news after which the page says so
const AGAIN = 1000; // [ms] between two attempts to connect
const SURE = 3000; // [ms] for the second press of reset
const NOTICED = 15; // [s] that a notice stays
const DITHERS = [0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1];
const OTHERS = [
  { key: "excitation", title: "excitation: rms of θ̇ [rad/s]", name: "base" },
  { key: "dither", title: "dither of the motor, rms [N m]", name: "torque" },
  { key: "nis", title: "mean normalised innovation squared (expected 2)", name: "estimate" },
];

const story = { start: null, update: null, startsOver: [] };
const element = (id) => document.getElementById(id);
let socket, lastHeard = 0, drawn = true, charts = [];

function connect() {
  const protocol = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${protocol}://${location.host}/socket`);
  socket.onmessage = (event) => hear(JSON.parse(event.data));
  socket.onclose = () => {
    lost("The connection to the server is lost; this page keeps trying.");
    setTimeout(connect, AGAIN);
  };
}

function hear(message) {
  lastHeard = performance.now();
  if (message.start) begin(message.start);
  if (message.update && story.start) goOn(message.update);
  if (message.refused) answer(`Refused: ${message.refused}`, true);
  if (message.sent) {
    const fields = Object.entries(message.sent).map(([key, value]) => `${key} ${value}`);
    answer(`Sent: ${fields.join(", ")}`);
  }
}

function begin(start) {
  const same = story.start?.model === start.model;
  story.start = start;
  story.update = null;
  story.startsOver = [];
  if (!same) forgetRanges();
  document.title = `lever live: ${start.title}`;
  element("title").textContent = start.title;
  document.body.classList.toggle("of-simulation", start.simulated);
  element("controls").hidden = !start.controls;
  element("read-only").hidden = start.controls;
  offerDither(start);
  offer("model", start.choices.model.map((name) => [name, name]), start.model ? null : "as it is", start.model);
  offer("estimator", start.choices.estimator.map((name) => [name, name]), "as it is");
  const rows = start.quantities.map((quantity) => {
    const [letter, index] = quantity.symbol.split(/<\/?sub>/);
    const name = cell("", "name");
    name.append(letter, Object.assign(document.createElement("sub"), { textContent: index ?? "" }), ` ${quantity.name}`);
    const unit = cell(quantity.unit === "1" ? "" : quantity.unit, "unit");
    return row([name, cell("–", "value"), cell("", "sigma"), unit, cell("", "truth simulated")]);
  });
  document.querySelector("#estimates tbody").replaceChildren(...rows);
  const bands = start.quantities.map((each) => [each.name, (canvas) => drawBand(canvas, story, each)]);
  const others = OTHERS.map((each) => [each.title, (canvas) => drawOther(canvas, story, each)]);
  charts = [
    ...place("#bands .charts", bands),
    ...place("#health .charts", others),
    () => drawBode(story),
    () => drawMap(story),
  ];
  redraw();
}

function goOn(update) {
  const { start } = story;
  if (story.update && update.run > story.update.run) story.startsOver.push(update.row[0]);
  story.update = update;
  start.rows.push(update.row);
  while (start.rows.length > start.span / start.step) start.rows.shift();
  if (update.map) start.map.push(update.map);
  while (start.map.length > start.span / start.map_step) start.map.shift();
  document.body.classList.toggle("stale", update.silence === null || update.silence > PATIENCE / 1000);
  tellCondition(update.level, update.condition);
  tellStart(update);
  tellEstimates(update.row);
  tellHealth(update.health);
  tellMessages(update.messages);
  for (const [request, mode] of [["run", "run"], ["freeze", "frozen"]]) {
    document.querySelector(`[data-request=${request}]`).setAttribute("aria-pressed", update.mode === mode);
  }
  redraw();
}

// --- words ----------------------------------------------------------------------------------------------------------

function tellCondition(level, text) {
  const place = element("condition");
  if (place.textContent !== text) place.textContent = text;
  place.className = level;
}

// Which run of a scenario this is, and for a while that it has begun.
function tellStart({ row, run }) {
  const { start, startsOver } = story, begun = startsOver.at(-1);
  element("title").textContent = run > 1 ? `${start.title}, run ${run}` : start.title;
  const isNew = begun !== undefined && row[0] - begun < NOTICED;
  element("notice").textContent = isNew ? "The scenario has started over, with other random numbers." : "";
}

function lost(text) {
  document.body.classList.add("stale");
  tellCondition("bad", text);
}

// A number with so many digits, without exponent; a dash for what is not known.
function written(value, digits) {
  if (value === null || value === undefined) return "–";
  if (value === 0) return "0";
  const decimals = digits - 1 - Math.floor(Math.log10(Math.abs(value)));
  return value.toFixed(Math.min(5, Math.max(0, decimals)));
}

function tellEstimates(values) {
  document.querySelectorAll("#estimates tr").forEach((line, k) => {
    const [value, sigma, truth] = values.slice(1 + 3 * k, 4 + 3 * k);
    line.querySelector(".value").textContent = written(value, 4);
    line.querySelector(".sigma").textContent = sigma === null ? "" : `± ${written(sigma, 2)}`;
    line.querySelector(".truth").textContent = truth === null ? "" : `(${written(truth, 4)})`;
  });
}

function tellHealth(facts) {
  document.querySelector("#health dl").replaceChildren(...facts.flatMap(([term, text, level]) => [
    Object.assign(document.createElement("dt"), { textContent: term }),
    Object.assign(document.createElement("dd"), { textContent: text, className: level }),
  ]));
}

function tellMessages(messages) {
  document.querySelector("#messages tbody").replaceChildren(...messages.map(([name, rate, ...counts]) => {
    const silent = rate === null && !counts.some(Boolean);
    const cells = counts.map((count) => cell(silent ? "–" : count));
    const line = row([cell(name), cell(rate === null ? "–" : rate.toFixed(0)), ...cells]);
    line.className = silent ? "silent" : counts.some(Boolean) ? "bad" : "";
    return line;
  }));
}

function cell(text, name = "") {
  return Object.assign(document.createElement("td"), { textContent: text, className: name });
}

function row(cells) {
  const line = document.createElement("tr");
  line.append(...cells);
  return line;
}

// --- charts ---------------------------------------------------------------------------------------------------------

function place(where, named) {
  const canvases = named.map(([name]) => {
    const said = { role: "img", ariaLabel: `${name} over time` };
    return Object.assign(document.createElement("canvas"), said);
  });
  document.querySelector(where).replaceChildren(...canvases);
  return named.map(([, draw], k) => () => draw(canvases[k]));
}

function redraw() {
  if (!drawn) return;
  drawn = false;
  requestAnimationFrame(() => {
    drawn = true;
    if (story.start) charts.forEach((draw) => draw());
  });
}

// --- controls -------------------------------------------------------------------------------------------------------

function offer(id, options, keep, chosen = "") {
  const all = keep === null ? options : [["", keep], ...options];
  const made = ([value, textContent]) => Object.assign(document.createElement("option"), { value, textContent });
  element(id).replaceChildren(...all.map(made));
  element(id).value = chosen ?? "";
}

// A model that does not know the motor's torque learns nothing from dither: it can only be switched off then.
function offerDither({ dither_limit: limit, model, without_torque: useless }) {
  const shown = DITHERS.filter((rms) => rms <= limit && !(useless && rms));
  offer("dither", shown.map((rms) => [rms, rms ? `${rms} N m rms` : "off"]), "as it is");
  element("useless").hidden = !useless;
  element("useless").textContent = `Dither does nothing for ${model}, which does not use the motor's torque.`;
}

function ask(command) {
  if (socket.readyState !== WebSocket.OPEN) return answer("Not sent: there is no connection.", true);
  socket.send(JSON.stringify(command));
  return undefined;
}

function answer(text, refused = false) {
  element("answer").textContent = text;
  element("answer").classList.toggle("refused", refused);
}

function requested(button) {
  const { request } = button.dataset;
  if (request === "reset" && !button.classList.contains("sure")) {
    button.classList.add("sure");
    button.textContent = "reset: sure?";
    setTimeout(() => unsure(button), SURE);
    return;
  }
  unsure(button);
  ask({ request });
}

function unsure(button) {
  button.classList.remove("sure");
  button.textContent = button.dataset.request;
}

document.querySelectorAll("[data-request]").forEach((button) => {
  button.addEventListener("click", () => requested(button));
});
for (const [what, field] of [["dither", "dither_rms"], ["model", "model"], ["estimator", "estimator"]]) {
  element(what).addEventListener("change", ({ target }) => {
    if (target.value) ask({ [field]: what === "dither" ? Number(target.value) : target.value });
  });
}
window.addEventListener("resize", redraw);
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
setInterval(() => {
  const isLate = socket.readyState === WebSocket.OPEN && performance.now() - lastHeard > PATIENCE;
  if (isLate) lost("No data from the server: what is shown is old.");
}, 500);
connect();
