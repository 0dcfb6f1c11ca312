// The robot, its map and the people in sight, drawn on one canvas. The camera follows what is known of the house.
import { CellMap } from "./frames.js";

const MARGIN_M = 0.9;
const LEAST_M = 5; // so much is in view at least: at the start little is known
const MOST_PX_PER_M = 130;
const CAMERA_S = 0.45;
const LONGEST_MS = 250; // between two frames: what comes later jumps
const FADE_MS = 250;
const FLASH_MS = 350;
const STRIDE_M = 1.4; // of two steps
const LIGHT = {
  cells: [[215, 221, 229], [255, 255, 255], [47, 52, 59]], beyond: "#d7dde5", robot: "#1f62c8", rim: "#123f86", trail: "#7aa6e4",
  fan: "31, 98, 200", flash: "179, 38, 30", words: "#3b424b",
};
const DARK = {
  cells: [[17, 19, 22], [58, 64, 72], [214, 210, 202]], beyond: "#111316", robot: "#5b9bea", rim: "#bcd8fa", trail: "#4d7fc0",
  fan: "120, 170, 235", flash: "255, 138, 128", words: "#c9cdd3",
};
const SHIRTS = ["#e38b1f", "#2f9e6e", "#b0569a", "#c25b4a", "#7a6fd0", "#8a7b2c"];
const SKIN = "#f0c8a0", HAIR = "#5a4334", SHOES = "#3d3a37";

const dark = matchMedia("(prefers-color-scheme: dark)");
const still = matchMedia("(prefers-reduced-motion: reduce)");
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const turned = (from, to, part) => from + part * Math.atan2(Math.sin(to - from), Math.cos(to - from));

export class Scene {
  constructor(canvas) {
    Object.assign(this, { canvas, pen: canvas.getContext("2d"), raster: document.createElement("canvas"), hello: null, waiting: false });
    new ResizeObserver(() => this.#size()).observe(canvas);
    dark.addEventListener("change", () => this.#repaint());
    this.clear();
  }

  clear() {
    Object.assign(this, {
      hello: null, map: null, camera: null, from: null, to: null, at: 0, lasts: 1, drawn: 0, trail: [], people: new Map(), fan: [], fanFrom: [], flashed: -FLASH_MS,
    });
    this.#soon();
  }

  // Takes what the server says of the house: rows, columns, metres a cell, the robot's radius, the fan.
  begin(hello) {
    Object.assign(this, { hello, map: new CellMap(hello.rows, hello.cols) });
    this.raster.width = hello.cols;
    this.raster.height = hello.rows;
    this.#repaint();
  }

  show(frame) {
    this.map.add(frame);
    this.map.paint(this.raster.getContext("2d"), this.#colours.cells, frame);
    const now = performance.now();
    this.lasts = clamp(now - this.at, 16, LONGEST_MS);
    this.fanFrom = this.to ? this.#ends(now) : [];
    this.from = this.to ? this.#pose(now) : frame;
    Object.assign(this, { to: frame, at: now, fan: this.#fanOf(frame) });
    if (frame.collided) this.flashed = now;
    const [x, y] = this.trail.at(-1) ?? [-9, -9];
    if (Math.hypot(frame.x - x, frame.y - y) > 0.5) this.trail.push([frame.x, frame.y]);
    this.#people(frame.bodies, now);
    this.#soon();
  }

  get #colours() { return dark.matches ? DARK : LIGHT; }

  #people(bodies, now) {
    for (const person of this.people.values()) if (person.gone === null) person.gone = now;
    for (const { number, x, y, radius, across, down } of bodies) {
      const walks = Math.hypot(across, down) * this.hello.cell_m > 0.15;
      const heading = walks ? Math.atan2(-down, across) : null;
      const before = this.people.get(number);
      const place = before && this.#placeOf(before, now);
      const far = place && Math.hypot(x - place.x, y - place.y) * this.hello.cell_m;
      this.people.set(number, {
        from: place ?? { x, y, heading: heading ?? 0, phase: number }, came: before?.came ?? now, gone: null, radius, shirt: SHIRTS[number % SHIRTS.length],
        to: { x, y, heading: heading ?? place?.heading ?? 0, phase: (place?.phase ?? number) + Math.min((far ?? 0) / STRIDE_M, 0.2) * 2 * Math.PI },
      });
    }
    for (const [number, { gone }] of this.people) if (gone !== null && now - gone > FADE_MS) this.people.delete(number);
  }

  #part(now) { return still.matches ? 1 : clamp((now - this.at) / this.lasts, 0, 1); }

  #pose(now) {
    const part = this.#part(now), { from, to } = this;
    return { x: from.x + part * (to.x - from.x), y: from.y + part * (to.y - from.y), heading: turned(from.heading, to.heading, part) };
  }

  #placeOf({ from, to }, now) {
    const part = this.#part(now), between = (name) => from[name] + part * (to[name] - from[name]);
    return { x: between("x"), y: between("y"), heading: turned(from.heading, to.heading, part), phase: between("phase") };
  }

  // Where the beams of a frame end.
  #fanOf({ x, y, heading, ranges }) {
    const half = this.hello.fov_deg / 360 * Math.PI, step = 2 * half / (this.hello.beams - 1);
    return ranges.map((range, i) => [x + range * Math.cos(heading - half + i * step), y - range * Math.sin(heading - half + i * step)]);
  }

  // Where they end now: the fan turns with the robot.
  #ends(now) {
    const part = this.#part(now);
    if (part === 1 || this.fanFrom.length !== this.fan.length) return this.fan;
    return this.fan.map(([x, y], i) => [x + (1 - part) * (this.fanFrom[i][0] - x), y + (1 - part) * (this.fanFrom[i][1] - y)]);
  }

  #size() {
    const dense = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(this.canvas.clientWidth * dense);
    this.canvas.height = Math.round(this.canvas.clientHeight * dense);
    this.dense = dense;
    this.#soon();
  }

  #repaint() {
    if (!this.hello) return;
    const { rows, cols } = this.hello;
    this.map.paint(this.raster.getContext("2d"), this.#colours.cells, { row: 0, col: 0, rows, cols });
    this.#soon();
  }

  #soon() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => { this.waiting = false; if (this.#draw(now)) this.#soon(); });
  }

  // Where the camera goes: the middle of what is known, in cells, and pixels a cell.
  #target() {
    const { cell_m } = this.hello, { width, height } = this.canvas;
    const margin = MARGIN_M / cell_m, least = LEAST_M / cell_m;
    const [left, top, right, bottom] = this.map.box ?? [0, 0, this.hello.cols, this.hello.rows];
    const wide = Math.max(right - left + 2 * margin, least), high = Math.max(bottom - top + 2 * margin, least);
    const scale = Math.min(width / wide, height / high, MOST_PX_PER_M * this.dense * cell_m);
    return { x: (left + right) / 2, y: (top + bottom) / 2, scale };
  }

  // Moves the camera by a part of its way; returns whether it has farther to go.
  #follow(now) {
    const target = this.#target(), { camera } = this;
    const part = camera && !still.matches ? 1 - Math.exp(-Math.min(now - this.drawn, 100) / 1000 / CAMERA_S) : 1;
    const from = camera ?? target;
    this.camera = {
      x: from.x + part * (target.x - from.x), y: from.y + part * (target.y - from.y), scale: from.scale * (target.scale / from.scale) ** part,
    };
    const off = Math.hypot(target.x - this.camera.x, target.y - this.camera.y) * target.scale;
    return off > 0.3 || Math.abs(Math.log(target.scale / this.camera.scale)) > 0.001;
  }

  // Draws; returns whether there is more to draw soon.
  #draw(now) {
    const { pen, canvas } = this, colours = this.#colours;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.fillStyle = colours.beyond;
    pen.fillRect(0, 0, canvas.width, canvas.height);
    if (!this.hello || !this.to || !canvas.width) return false;
    const moves = this.#follow(now);
    this.drawn = now;
    const { x, y, scale } = this.camera;
    pen.setTransform(scale, 0, 0, scale, canvas.width / 2 - x * scale, canvas.height / 2 - y * scale);
    pen.imageSmoothingEnabled = false;
    pen.drawImage(this.raster, 0, 0);
    const pose = this.#pose(now);
    this.#beams(pose, now, colours);
    this.#way(pose, colours);
    for (const person of this.people.values()) this.#person(person, now);
    this.#robot(pose, colours, now);
    this.#ruler(colours);
    const fades = [...this.people.values()].some(({ came, gone }) => gone !== null || now - came < FADE_MS);
    return moves || this.#part(now) < 1 || now - this.flashed < FLASH_MS || fades;
  }

  #beams({ x, y }, now, colours) {
    const { pen } = this, ends = this.#ends(now);
    const far = ends.reduce((most, end) => Math.max(most, Math.hypot(end[0] - x, end[1] - y)), 1);
    const light = pen.createRadialGradient(x, y, 0, x, y, far);
    light.addColorStop(0, `rgba(${colours.fan}, .30)`);
    light.addColorStop(1, `rgba(${colours.fan}, .06)`);
    pen.fillStyle = light;
    pen.beginPath();
    if (this.hello.fov_deg < 360) pen.moveTo(x, y);
    for (const end of ends) pen.lineTo(...end);
    pen.fill();
  }

  #way(pose, colours) {
    const { pen } = this;
    pen.strokeStyle = colours.trail;
    pen.lineWidth = Math.max(2 * this.dense / this.camera.scale, 0.6);
    pen.lineJoin = "round";
    pen.beginPath();
    for (const [x, y] of this.trail.slice(0, -1)) pen.lineTo(x, y);
    pen.lineTo(pose.x, pose.y);
    pen.stroke();
  }

  #robot({ x, y, heading }, colours, now) {
    const { pen } = this, radius = Math.max(this.hello.radius_px, 5 * this.dense / this.camera.scale);
    const flash = 1 - (now - this.flashed) / FLASH_MS;
    pen.save();
    pen.translate(x, y);
    pen.rotate(-heading);
    pen.scale(radius, radius);
    if (flash > 0) disc(pen, 0, 0, 1.2 + 0.8 * (1 - flash), `rgba(${colours.flash}, ${0.55 * flash})`);
    disc(pen, 0, 0, 1, colours.rim);
    disc(pen, 0, 0, 0.86, flash > 0 ? `rgb(${colours.flash})` : colours.robot);
    pen.fillStyle = "#fff";
    pen.beginPath();
    for (const [ahead, aside] of [[0.68, 0], [-0.3, 0.46], [-0.06, 0], [-0.3, -0.46]]) pen.lineTo(ahead, aside);
    pen.fill();
    pen.restore();
  }

  // A person from above: shoes, arms, shoulders, a head that looks ahead.
  #person(person, now) {
    const { pen } = this, { x, y, heading, phase } = this.#placeOf(person, now);
    const swing = Math.sin(phase);
    pen.save();
    pen.globalAlpha = person.gone === null ? clamp((now - person.came) / FADE_MS, 0.2, 1) : clamp(1 - (now - person.gone) / FADE_MS, 0, 1);
    pen.translate(x, y);
    pen.rotate(-heading);
    pen.scale(person.radius, person.radius);
    for (const side of [-1, 1]) oval(pen, 0.1 + side * 0.5 * swing, side * 0.36, 0.34, 0.19, SHOES);
    for (const side of [-1, 1]) oval(pen, 0.1 - side * 0.32 * swing, side * 0.82, 0.24, 0.17, SKIN);
    oval(pen, 0, 0, 0.48, 0.95, person.shirt);
    oval(pen, 0.4, 0, 0.16, 0.13, SKIN);
    disc(pen, 0.06, 0, 0.42, SKIN);
    disc(pen, -0.04, 0, 0.4, HAIR);
    pen.restore();
  }

  // How long a metre is, now that the view zooms.
  #ruler(colours) {
    const { pen, canvas, dense } = this, pixels = this.camera.scale / this.hello.cell_m;
    const metres = [1, 2, 5, 10, 20, 50].find((each) => each * pixels > 50 * dense) ?? 100;
    const left = 14 * dense, low = canvas.height - 14 * dense;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.strokeStyle = pen.fillStyle = colours.words;
    pen.lineWidth = 1.5 * dense;
    pen.beginPath();
    for (const [x, y] of [[left, low - 5 * dense], [left, low], [left + metres * pixels, low], [left + metres * pixels, low - 5 * dense]]) pen.lineTo(x, y);
    pen.stroke();
    pen.font = `${12 * dense}px system-ui, sans-serif`;
    pen.fillText(`${metres} m`, left + 5 * dense, low - 5 * dense);
  }
}

function disc(pen, x, y, radius, colour) { oval(pen, x, y, radius, radius, colour); }

function oval(pen, x, y, ahead, aside, colour) {
  pen.fillStyle = colour;
  pen.beginPath();
  pen.ellipse(x, y, ahead, aside, 0, 0, 2 * Math.PI);
  pen.fill();
}
