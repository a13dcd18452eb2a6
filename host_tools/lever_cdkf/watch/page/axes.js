// A chart's paper: axes, lines and bands on a canvas, in the colours that the style sheet says at the moment.

const LEFT = 56, RIGHT = 10, TOP = 24, BOTTOM = 22;
const BAR = { gap: 8, width: 10, room: 64 }; // of a colour bar, right of the chart
const LINE = 14; // height of a label

export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

// Round numbers between low and high, about `count` of them.
export function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) {
    found.push(Number((k * step).toPrecision(12)));
  }
  return found;
}

export function logTicks(low, high, count) {
  const all = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
    for (const factor of [1, 2, 5]) all.push(factor * 10 ** power);
  }
  const inside = all.filter((value) => value >= low * 0.999 && value <= high * 1.001);
  if (inside.length < 3) return ticks(low, high, count / 2);
  return inside.length > count ? inside.filter((value) => Math.log10(value) % 1 === 0) : inside;
}

function ticksOf({ low, high, log }, ofLog, ofLinear) {
  if (log) return logTicks(low, high, ofLog);
  const found = ticks(low, high, ofLinear);
  return found.length > 1 ? found : ticks(low, high, 2 * ofLinear);
}

function written(value) {
  return Number(value.toPrecision(6)).toString().replace("-", "−");
}

// x and y: {low, high, log, unit, ticks}; bar: {low, high, unit, at}, where `at` is the colour [r, g, b] of a part of
// the range. Takes the whole canvas; what is drawn afterwards is clipped to the inside of the axes.
export class Axes {
  constructor(canvas, title, x, y, bar = null) {
    const scale = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = Math.round(width * scale); // clears it, and what an earlier drawing has set
    canvas.height = Math.round(height * scale);
    this.pen = canvas.getContext("2d");
    this.pen.scale(scale, scale);
    this.x = x;
    this.y = y;
    const right = bar ? BAR.room : RIGHT;
    this.box = { left: LEFT, top: TOP, width: width - LEFT - right, height: height - TOP - BOTTOM };
    this.#frame(title);
    if (bar) this.#bar(bar);
    this.pen.beginPath();
    this.pen.rect(this.box.left, this.box.top, this.box.width, this.box.height);
    this.pen.clip();
  }

  #frame(title) {
    const { pen, box, x, y } = this;
    pen.font = "12px system-ui, sans-serif";
    pen.fillStyle = colour("quiet");
    pen.textBaseline = "middle";
    pen.textAlign = "left";
    pen.fillText(title, 2, 8);
    pen.strokeStyle = colour("grid");
    pen.lineWidth = 1;
    pen.textAlign = "right";
    const yTicks = y.ticks ?? ticksOf(y, 7, Math.max(3, box.height / 38));
    let below = Infinity; // of the label before
    for (const value of yTicks) {
      const at = this.atY(value);
      this.#rule(box.left, at, box.left + box.width, at);
      if (at + LINE > below) continue;
      pen.fillText(written(value), box.left - 6, at);
      below = at;
    }
    pen.textAlign = "center";
    const xTicks = x.ticks ?? ticksOf(x, 9, Math.max(2, box.width / 70));
    let before = Infinity; // the left end of the label to the right
    for (const value of [...xTicks].reverse()) {
      const at = this.atX(value), text = x.unit ? `${written(value)}${x.unit}` : written(value);
      this.#rule(at, box.top, at, box.top + box.height);
      const half = pen.measureText(text).width / 2, middle = Math.min(at, box.left + box.width - half + RIGHT);
      if (middle + half + 6 > before) continue;
      pen.fillText(text, middle, box.top + box.height + 12);
      before = middle - half;
    }
  }

  // The colours of a map, with their values.
  #bar({ low, high, unit, at }) {
    const { pen, box } = this, left = box.left + box.width + BAR.gap;
    const shades = pen.createLinearGradient(0, box.top + box.height, 0, box.top);
    for (let part = 0; part <= 1; part += 0.125) {
      shades.addColorStop(part, `rgb(${at(part).map(Math.round).join(",")})`);
    }
    pen.fillStyle = shades;
    pen.fillRect(left, box.top, BAR.width, box.height);
    pen.fillStyle = colour("quiet");
    pen.textAlign = "left";
    for (const value of ticks(low, high, 5)) {
      const y = box.top + box.height * (1 - (value - low) / (high - low));
      pen.fillText(written(value), left + BAR.width + 5, y);
    }
    pen.textAlign = "right";
    pen.fillText(unit, left + BAR.room - BAR.gap, 8);
  }

  #rule(x0, y0, x1, y1) {
    this.pen.beginPath();
    this.pen.moveTo(x0, y0);
    this.pen.lineTo(x1, y1);
    this.pen.stroke();
  }

  atX(value) { return this.box.left + this.box.width * share(this.x, value); }
  atY(value) { return this.box.top + this.box.height * (1 - share(this.y, value)); }

  // A curve; null is a gap.
  line(xs, ys, name, { width = 1.8, dash = [], alpha = 1 } = {}) {
    const { pen } = this;
    pen.save();
    pen.strokeStyle = colour(name);
    pen.globalAlpha = alpha;
    pen.lineWidth = width;
    pen.lineJoin = "round";
    pen.setLineDash(dash);
    pen.beginPath();
    let drawing = false;
    xs.forEach((x, k) => {
      const known = isKnown(ys[k]);
      if (known) pen[drawing ? "lineTo" : "moveTo"](this.atX(x), this.atY(ys[k]));
      drawing = known;
    });
    pen.stroke();
    pen.restore();
  }

  // Dotted lines from top to bottom.
  marks(xs) {
    for (const x of xs) this.line([x, x], [this.y.low, this.y.high], "mark", { dash: [2, 3], width: 1.2 });
  }

  // The area between two curves, in pieces where one of them is not known.
  band(xs, lows, highs, name) {
    const { pen } = this;
    pen.fillStyle = colour(name);
    let piece = [];
    const fill = () => {
      if (piece.length > 1) {
        pen.beginPath();
        for (const k of piece) pen.lineTo(this.atX(xs[k]), this.atY(highs[k]));
        for (const k of piece.reverse()) pen.lineTo(this.atX(xs[k]), this.atY(lows[k]));
        pen.fill();
      }
      piece = [];
    };
    xs.forEach((_, k) => (isKnown(lows[k]) && isKnown(highs[k]) ? piece.push(k) : fill()));
    fill();
  }

  // Words in the middle, where there is nothing to draw.
  say(text) {
    const { pen, box } = this;
    pen.fillStyle = colour("quiet");
    pen.textAlign = "center";
    pen.fillText(text, box.left + box.width / 2, box.top + box.height / 2);
  }
}

export function isKnown(value) { return value !== null && value !== undefined; }

function share(axis, value) {
  if (!axis.log) return (value - axis.low) / (axis.high - axis.low);
  return Math.log(Math.max(value, 1e-12) / axis.low) / Math.log(axis.high / axis.low);
}

// The range of an axis: opens at once, closes slowly, so that it does not tremble.
export class Range {
  constructor(log = false) { this.log = log; }

  follow(low, high) {
    if (!Number.isFinite(low) || !Number.isFinite(high)) {
      return this.low === undefined ? { low: this.log ? 0.01 : 0, high: 1, log: this.log } : this.now();
    }
    let [a, b] = this.log ? [Math.log(low), Math.log(high)] : [low, high];
    const margin = 0.08 * (b - a) || 0.1 * Math.abs(a) || 0.1;
    a -= margin;
    b += margin;
    const part = 0.03;
    this.low = this.low === undefined || a < this.low ? a : this.low + part * (a - this.low);
    this.high = this.high === undefined || b > this.high ? b : this.high + part * (b - this.high);
    return this.now();
  }

  now() {
    if (!this.log) return { low: this.low, high: this.high };
    return { low: Math.exp(this.low), high: Math.exp(this.high), log: true };
  }
}
