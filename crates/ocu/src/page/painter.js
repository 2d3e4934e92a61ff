// Draws the map's own marks on a canvas: grid, lines, pins, the vehicle, the scale and north.

/** Most lines of the grid in one direction: a screen has fewer. */
const MOST_LINES = 500;

/** A canvas as it is seen now: how places lie on it, and in which colours. */
export class Painter {
  #context;
  #colours;
  #toScreen;
  #scale;

  /** `toScreen` gives the pixel of a place; `scale` is in pixels a metre. */
  constructor(context, colours, toScreen, scale) {
    [this.#context, this.#colours, this.#toScreen, this.#scale] = [context, colours, toScreen, scale];
  }

  /** Lines of whole metres between two corners, `top` being the northwest one. */
  grid(width, height, top, bottom) {
    const step = roundStep(44 / this.#scale);
    const context = this.#context;
    context.lineWidth = 1;
    const line = (index, from, to) => {
      context.strokeStyle = this.#colours[index % 5 === 0 ? "grid-strong" : "grid"];
      context.beginPath();
      context.moveTo(...from);
      context.lineTo(...to);
      context.stroke();
    };
    for (const index of wholes(bottom.x / step, top.x / step)) {
      const y = Math.round(this.#toScreen({ x: index * step, y: 0 })[1]) + 0.5;
      line(index, [0, y], [width, y]);
    }
    for (const index of wholes(top.y / step, bottom.y / step)) {
      const x = Math.round(this.#toScreen({ x: 0, y: index * step })[0]) + 0.5;
      line(index, [x, 0], [x, height]);
    }
  }

  /** A line through places; with a halo unless it is dashed. */
  line(places, colour, width, dash) {
    if (places.length < 2) return;
    const context = this.#context;
    context.lineJoin = context.lineCap = "round";
    context.beginPath();
    for (const place of places) context.lineTo(...this.#toScreen(place));
    context.setLineDash([]);
    if (!dash.length) {
      context.strokeStyle = this.#colours.halo;
      context.lineWidth = width + 4;
      context.stroke();
    }
    context.setLineDash(dash);
    context.strokeStyle = this.#colours[colour];
    context.lineWidth = width;
    context.stroke();
    context.setLineDash([]);
  }

  /** A pin whose tip is the place: filled for the mission's, hollow for one that is only chosen. */
  pin(place, filled) {
    const context = this.#context;
    const [x, y] = this.#toScreen(place);
    context.beginPath();
    context.moveTo(x, y);
    context.bezierCurveTo(x - 4, y - 12, x - 13, y - 16, x - 13, y - 26);
    context.arc(x, y - 26, 13, Math.PI, 0);
    context.bezierCurveTo(x + 13, y - 16, x + 4, y - 12, x, y);
    context.fillStyle = filled ? this.#colours.destination : this.#colours.halo;
    context.strokeStyle = filled ? this.#colours.halo : this.#colours.destination;
    context.lineWidth = filled ? 2 : 3.5;
    context.fill();
    context.stroke();
    context.beginPath();
    context.arc(x, y - 26, 5, 0, 2 * Math.PI);
    context.fillStyle = filled ? this.#colours.halo : this.#colours.destination;
    context.fill();
  }

  /** The vehicle as an arrow, or as a disc if its heading is unknown. */
  vehicle(pose, fresh) {
    const context = this.#context;
    context.save();
    context.translate(...this.#toScreen(pose));
    context.beginPath();
    if (pose.yaw === null) {
      context.arc(0, 0, 11, 0, 2 * Math.PI);
    } else {
      context.rotate(pose.yaw);
      context.moveTo(0, -21);
      context.lineTo(14, 15);
      context.lineTo(0, 8);
      context.lineTo(-14, 15);
      context.closePath();
    }
    context.lineJoin = "round";
    context.lineWidth = 3;
    context.fillStyle = fresh ? this.#colours.vehicle : this.#colours.stale;
    context.strokeStyle = this.#colours["vehicle-edge"];
    context.fill();
    context.stroke();
    context.restore();
  }

  /** The bar that shows a round length. */
  scale(height) {
    const context = this.#context;
    const length = roundStep(70 / this.#scale);
    const [x, y, wide] = [16, height - 18, length * this.#scale];
    const bar = () => {
      context.beginPath();
      context.moveTo(x, y - 7);
      context.lineTo(x, y);
      context.lineTo(x + wide, y);
      context.lineTo(x + wide, y - 7);
      context.stroke();
    };
    const label = length >= 1000 ? `${length / 1000} km` : length >= 1 ? `${length} m` : `${length * 100} cm`;
    context.font = "600 14px system-ui, sans-serif";
    context.textAlign = "left";
    context.lineCap = context.lineJoin = "round";
    [context.strokeStyle, context.lineWidth] = [this.#colours.halo, 6];
    bar();
    context.lineWidth = 4;
    context.strokeText(label, x + 6, y - 7);
    [context.strokeStyle, context.lineWidth, context.fillStyle] = [this.#colours.ink, 2, this.#colours.ink];
    bar();
    context.fillText(label, x + 6, y - 7);
  }

  /** An arrow to true north if the frame's place on the globe is known, otherwise along X. */
  north(width, heading) {
    const context = this.#context;
    const [x, middle] = [width / 2, 18];
    context.save();
    context.translate(x, middle);
    context.rotate(-(heading));
    context.translate(-x, -middle);
    context.font = "700 14px system-ui, sans-serif";
    context.textAlign = "center";
    [context.strokeStyle, context.lineWidth, context.fillStyle] = [this.#colours.halo, 4, this.#colours.ink];
    context.strokeText("N", x, 28);
    context.fillText("N", x, 28);
    context.beginPath();
    context.moveTo(x, 4);
    context.lineTo(x + 6, 14);
    context.lineTo(x - 6, 14);
    context.closePath();
    context.fill();
    context.restore();
  }
}

/** The next of 1, 2, 5 times a power of ten. */
/** The whole numbers from one number to another. */
function wholes(from, to) {
  const first = Math.ceil(from);
  const count = Math.min(Math.max(Math.floor(to) - first + 1, 0), MOST_LINES);
  return Array.from({ length: count }, (_, index) => first + index);
}

function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((digit) => digit * power).find((step) => step >= least * 0.999);
}
