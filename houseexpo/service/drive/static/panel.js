// One robot: its socket, its map, its driver.
import { paintMap, readFrame } from "./frames.js";

const ROBOT = "#1f62c8";
const TRAIL = "#7aa6e4";
const BODY = "#e38b1f";
const SAVED = 2;
const SOON_MS = 3000;
const COMPILING = "The house is made ready… What drives here for the first time is compiled first: up to 40 seconds, once.";

export class Panel {
  constructor(template, address, plan, driver) {
    this.element = template.content.firstElementChild.cloneNode(true);
    this.#find();
    Object.assign(this, { address, plan, hello: null, trail: [], frame: null, held: false, moving: "0 0" });
    this.driver.value = driver;
    new ResizeObserver(() => this.#lay()).observe(this.element.querySelector(".view"));
    this.element.querySelector(".save").addEventListener("click", () => this.save());
    this.element.querySelector(".hold").addEventListener("click", () => this.hold());
  }

  #find() {
    const one = (name) => this.element.querySelector(name);
    this.driver = one(".driver");
    this.map = one(".map");
    this.over = one(".over");
    this.facts = one(".facts");
    this.said = one(".said");
  }

  get byHand() {
    return this.driver.value === "you";
  }

  // Sets the robot down anew; `options` are those of the form.
  begin({ pace, ...options }) {
    this.end();
    Object.assign(this, { hello: null, trail: [], frame: null, pace, held: false, moving: "0 0" });
    this.element.dataset.state = "waiting";
    this.facts.textContent = "";
    this.#say("The house is made ready…");
    const hold = this.element.querySelector(".hold");
    Object.assign(hold, { hidden: this.byHand, textContent: "Hold" });
    this.element.querySelector(".pad").hidden = !this.byHand;
    const socket = new WebSocket(new URL(this.address, location.href.replace(/^http/, "ws")));
    socket.binaryType = "arraybuffer";
    let opened = false; // a server that has no room for another socket does not open it, and cannot say why
    socket.addEventListener("open", () => { opened = true; this.#send({ do: "start", plan: this.plan, driver: this.driver.value, ...options }); });
    socket.addEventListener("message", (event) => { if (socket === this.socket) this.#hear(event.data); });
    socket.addEventListener("close", (event) => {
      if (socket !== this.socket) return;
      this.element.dataset.state = "closed";
      const why = opened ? "The robot is gone. Set it down anew."
        : "No robot could be set down: too many drive here already, or the server is gone. Close other pages that drive, and set it down anew.";
      if (!this.failed) this.#say(event.reason || why, true);
    });
    Object.assign(this, { socket, failed: false });
    setTimeout(() => { if (socket === this.socket && !this.hello && !this.failed && socket.readyState <= WebSocket.OPEN) this.#say(COMPILING); }, SOON_MS);
  }

  end() {
    const { socket } = this;
    this.socket = null;
    socket?.close();
  }

  // Moves by shares of the full speed, ahead and to the left.
  move(linear, angular) {
    const moving = `${linear} ${angular}`;
    if (!this.byHand || !this.hello || moving === this.moving) return;
    this.moving = moving;
    this.#send({ do: "move", linear, angular });
  }

  hold() {
    if (this.byHand || !this.hello) return;
    this.held = !this.held;
    this.element.querySelector(".hold").textContent = this.held ? "Go on" : "Hold";
    this.#send({ do: "pace", steps_per_s: this.held ? 0 : this.pace });
  }

  save() {
    if (this.hello) this.#send({ do: "save" });
  }

  #send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  #say(text, bad = false) {
    this.said.textContent = text;
    this.said.classList.toggle("bad", bad);
  }

  #hear(data) {
    if (typeof data === "string") {
      const told = JSON.parse(data);
      if (told.error) {
        this.failed = true;
        this.#say(told.error, true);
      } else this.#start(told.hello);
    } else if (new Uint8Array(data, 0, 1)[0] === SAVED) this.#download(data.slice(1));
    else this.#show(readFrame(data));
  }

  #start(hello) {
    this.hello = hello;
    this.map.width = hello.cols;
    this.map.height = hello.rows;
    const context = this.map.getContext("2d");
    context.fillStyle = "#d7dde5";
    context.fillRect(0, 0, hello.cols, hello.rows);
    this.#lay();
    this.#say("");
    this.element.dataset.state = "driving";
    if (!this.byHand) this.#send({ do: "pace", steps_per_s: this.pace });
  }

  #show(frame) {
    paintMap(this.map.getContext("2d"), frame);
    const [x, y] = this.trail.at(-1) ?? [-9, -9];
    if (Math.hypot(frame.x - x, frame.y - y) > 0.5) this.trail.push([frame.x, frame.y]);
    this.frame = frame;
    this.element.dataset.frame = frame.number;
    this.facts.textContent = `${Math.round(frame.coverage * 100)}% seen · ${frame.explored.toFixed(1)} m² · `
      + `${frame.path.toFixed(1)} m · ${frame.collisions} bumps`;
    if (frame.ended) {
      this.element.dataset.state = "ended";
      this.#say(frame.success ? "All is seen." : "The explorer is done.");
    }
    requestAnimationFrame(() => this.#draw());
    this.#send({ do: "seen", number: frame.number });
  }

  // The map as large as the view allows; the drawing over it has the screen's own pixels.
  #lay() {
    if (!this.hello) return;
    const view = this.element.querySelector(".view");
    const { rows, cols } = this.hello;
    const scale = Math.min(view.clientWidth / cols, view.clientHeight / rows);
    for (const canvas of [this.map, this.over]) {
      canvas.style.width = `${cols * scale}px`;
      canvas.style.height = `${rows * scale}px`;
    }
    const dense = window.devicePixelRatio || 1;
    this.over.width = Math.round(cols * scale * dense);
    this.over.height = Math.round(rows * scale * dense);
    this.scale = scale * dense;
    this.#draw();
  }

  #draw() {
    const { frame, hello, scale } = this;
    if (!frame || !hello) return;
    const pen = this.over.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.over.width, this.over.height);
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    this.#fan(pen, frame, hello);
    pen.strokeStyle = TRAIL;
    pen.lineWidth = Math.max(1.5 / scale, 0.8);
    pen.beginPath();
    for (const [x, y] of this.trail) pen.lineTo(x, y);
    pen.stroke();
    for (const [x, y, radius] of frame.bodies) disc(pen, x, y, radius, BODY);
    disc(pen, frame.x, frame.y, Math.max(hello.radius_px, 3 / scale), frame.collided ? "#b3261e" : ROBOT);
    pen.strokeStyle = "#fff";
    pen.lineWidth = Math.max(2 / scale, 0.8);
    pen.beginPath();
    pen.moveTo(frame.x, frame.y);
    pen.lineTo(frame.x + 0.8 * hello.radius_px * Math.cos(frame.heading), frame.y - 0.8 * hello.radius_px * Math.sin(frame.heading));
    pen.stroke();
  }

  #fan(pen, frame, hello) {
    const half = hello.fov_deg / 360 * Math.PI;
    pen.fillStyle = "rgba(31, 98, 200, .13)";
    pen.beginPath();
    if (hello.fov_deg < 360) pen.moveTo(frame.x, frame.y);
    frame.ranges.forEach((range, i) => {
      const angle = frame.heading - half + 2 * half * i / (hello.beams - 1);
      pen.lineTo(frame.x + range * Math.cos(angle), frame.y - range * Math.sin(angle));
    });
    pen.fill();
  }

  #download(data) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([data], { type: "application/zip" }));
    link.download = `${this.plan}-${this.driver.value}.zip`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    this.#say("Path and map are saved.");
  }
}

function disc(pen, x, y, radius, colour) {
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
}
