// The charts of the page, drawn from what the server has told (see lever_cdkf/watch/state.py).

import { Axes, Range, isKnown } from "./axes.js";

const PAST = 20; // [s] of former responses
const WIDEST = 30; // a band wider than this factor does not widen the axis
// Viridis of matplotlib (CC0), eight colours of it.
const VIRIDIS = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"].map(
  (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16)),
);
const TRUTH = { dash: [6, 4], width: 1.4 };

const ranges = new Map();

export function forgetRanges() { ranges.clear(); }

function range(name, log = false) {
  if (!ranges.has(name)) ranges.set(name, new Range(log));
  return ranges.get(name);
}

function known(values) { return values.filter(isKnown); }

// What they reach, without the wildest part to either side.
function reach(values, part = 0.03) {
  const sorted = known(values).sort((a, b) => a - b);
  return [sorted[Math.floor(part * (sorted.length - 1))], sorted[Math.ceil((1 - part) * (sorted.length - 1))]];
}

// --- over frequency ---

export function drawBode(story) {
  const { start } = story;
  const frequency = { low: start.frequencies[0], high: start.frequencies.at(-1), log: true, unit: " Hz" };
  drawMagnitude(story, frequency);
  drawPhase(story, frequency);
  drawCoherence(story, frequency);
}

function drawMagnitude({ start, update }, frequency) {
  const bode = update?.bode, now = update?.row[0];
  const past = start.map.filter(([time, column]) => column.length && update && now - time < PAST);
  const lows = bode?.magnitude.map((middle, k) => Math.max(bode.low[k] ?? middle, middle / WIDEST)) ?? [];
  const highs = bode?.magnitude.map((middle, k) => Math.min(bode.high[k] ?? middle, middle * WIDEST)) ?? [];
  const former = past.flatMap(([, column]) => column);
  const all = [...(bode?.magnitude ?? []), ...lows, ...highs, ...known(update?.truth ?? []), ...former];
  const positive = all.filter((value) => value > 0);
  const limits = range("magnitude", true).follow(Math.min(...positive), Math.max(...positive));
  const axes = new Axes(document.getElementById("magnitude"), "θ/z̈ [deg per m/s²]", frequency, limits);
  for (const [time, column] of past) {
    axes.line(start.map_frequencies, column, "estimate", { width: 1, alpha: 0.3 * (1 - (now - time) / PAST) });
  }
  drawResponse(axes, start.frequencies, bode?.magnitude, bode?.low, bode?.high, update?.truth);
}

function drawPhase({ start, update }, frequency) {
  const bode = update?.bode, phases = known([...(bode?.phase ?? [-360, -180]), ...(update?.truth_phase ?? [])]);
  const low = Math.floor(Math.min(...phases) / 90) * 90, high = Math.ceil(Math.max(...phases) / 90) * 90;
  const ticks = [];
  for (let tick = low; tick <= high; tick += high - low > 180 ? 90 : 45) ticks.push(tick);
  const limits = { low: low - 15, high: high + 15, ticks };
  const axes = new Axes(document.getElementById("phase"), "phase [deg]", frequency, limits);
  drawResponse(axes, start.frequencies, bode?.phase, bode?.phase_low, bode?.phase_high, update?.truth_phase);
}

function drawResponse(axes, frequencies, middle, low, high, truth) {
  if (middle) {
    axes.band(frequencies, low, high, "estimate-band");
    axes.line(frequencies, middle, "estimate", { width: 2.2 });
  } else axes.say("no estimate yet");
  if (truth) axes.line(frequencies, truth, "truth", TRUTH);
}

// Measured, and what chance alone would give.
function drawCoherence({ start, update }, frequency) {
  const title = `measured coherence of θ and z̈, last ${start.coherence_span} s`;
  const limits = { low: 0, high: 1.05, ticks: [0, 0.5, 1] };
  const axes = new Axes(document.getElementById("coherence"), title, frequency, limits);
  const measured = update?.coherence;
  if (!measured) return axes.say("not enough samples yet");
  axes.line(start.coherence_frequencies, measured.values, "base", { width: 2 });
  const chance = [measured.chance, measured.chance];
  axes.line([frequency.low, frequency.high], chance, "quiet", { dash: [5, 4], width: 1.2 });
  return undefined;
}

// --- over time ---

function timeAxis(start) { return { low: -start.span, high: 0, unit: " s" }; }

function times({ start, update }) {
  const now = update?.row[0] ?? 0;
  return start.rows.map((row) => row[0] - now);
}

// When the scenario has started over.
function starts({ update, startsOver }) { return startsOver.map((time) => time - (update?.row[0] ?? 0)); }

export function drawMap(story) {
  const { start, update } = story, now = update?.row[0] ?? 0;
  const frequency = { low: start.map_frequencies[0], high: start.map_frequencies.at(-1), log: true };
  const columns = start.map.filter(([, column]) => column.length);
  const peaks = columns.map(([, column]) => Math.max(...column)).sort((a, b) => a - b);
  const brightest = peaks[Math.floor(0.9 * (peaks.length - 1))] ?? 1, count = start.map_frequencies.length;
  const bar = { low: 0, high: brightest, unit: "deg per m/s²", at: viridis };
  const axes = new Axes(document.getElementById("magnitude-map"), "frequency [Hz]", timeAxis(start), frequency, bar);
  if (!columns.length) return axes.say("no estimate yet");
  const paper = new OffscreenCanvas(columns.length, count), pen = paper.getContext("2d");
  const image = pen.createImageData(columns.length, count);
  columns.forEach(([, column], x) => column.forEach((value, k) => {
    image.data.set([...viridis(value / brightest), 255], 4 * ((count - 1 - k) * columns.length + x));
  }));
  pen.putImageData(image, 0, 0);
  const left = axes.atX(columns[0][0] - now), right = axes.atX(columns.at(-1)[0] + start.map_step - now);
  axes.pen.imageSmoothingEnabled = true;
  axes.pen.drawImage(paper, left, axes.box.top, right - left, axes.box.height);
  const place = column(start, "natural_frequency");
  axes.line(times(story), start.rows.map((row) => row[place]), "on-map", { width: 1.4 });
  axes.line(times(story), start.rows.map((row) => row[place + 2]), "on-map", { dash: [5, 4], width: 1.2 });
  return undefined;
}

function viridis(part) {
  const at = Math.min(1, Math.max(0, part || 0)) * (VIRIDIS.length - 1);
  const low = Math.min(Math.floor(at), VIRIDIS.length - 2);
  return VIRIDIS[low].map((value, k) => value + (at - low) * (VIRIDIS[low + 1][k] - value));
}

// Where a value is in a row: time; value, sigma and truth of each quantity; the others.
export function column(start, key) {
  const place = start.quantities.findIndex((quantity) => quantity.key === key);
  return place >= 0 ? 1 + 3 * place : 1 + 3 * start.quantities.length + start.others.indexOf(key);
}

export function drawBand(canvas, story, quantity) {
  const { start } = story, place = column(start, quantity.key), time = times(story);
  const value = start.rows.map((row) => row[place]), truth = start.rows.map((row) => row[place + 2]);
  const edge = (sign) => start.rows.map((row) => {
    const sigma = row[place + 1];
    return isKnown(row[place]) && isKnown(sigma) ? row[place] + sign * start.sigmas * sigma : null;
  });
  const low = edge(-1), high = edge(1);
  const inside = [...reach(low, 0.2), ...reach(high, 0.2), ...reach(value), ...reach(truth)].filter(Number.isFinite);
  const limits = range(quantity.key).follow(Math.min(...inside), Math.max(...inside));
  const unit = quantity.unit === "1" ? "" : ` [${quantity.unit}]`;
  const axes = new Axes(canvas, `${quantity.name}${unit}`, timeAxis(start), limits);
  axes.marks(starts(story));
  axes.band(time, low, high, "estimate-band");
  axes.line(time, value, "estimate");
  axes.line(time, truth, "truth", { dash: [5, 4], width: 1.3 });
  if (!known(value).length) axes.say("no estimate yet");
}

export function drawOther(canvas, story, { key, title, name }) {
  const { start } = story, place = column(start, key);
  const value = start.rows.map((row) => row[place]), [, high] = reach(value);
  const axes = new Axes(canvas, title, timeAxis(start), range(key).follow(0, Math.max(high || 0, 0.01)));
  axes.marks(starts(story));
  axes.line(times(story), value, name);
}
