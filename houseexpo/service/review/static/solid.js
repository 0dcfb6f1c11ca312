// The source in three dimensions, cut off above a height, with the plan's doors and the place of the question.
const DOOR_M = 2; // the height to which doors are drawn
const POLE_M = 2.6, RING_M = 0.4; // the place of the question: the height of a pole, and a ring around its foot
const LENS = 1.7; // the focal length, in half heights of the picture
const TURN = 0.01, STEP = 0.15; // radians of a pixel, and of a key
const FLAT = [0.05, Math.PI / 2]; // the lowest and the highest view
const FLOOR_M = 0.05; // lines on the floor lie above it

const PLACE = `uniform vec3 eye, right, up, ahead; uniform float aspect, far; in vec3 at; out vec3 here;
void main() {
  vec3 way = at - eye; float near = far / 1000.0, deep = dot(ahead, way);
  here = at;
  gl_Position = vec4(dot(right, way) * ${LENS} / aspect, dot(up, way) * ${LENS}, (deep * (far + near) - 2.0 * far * near) / (far - near), deep);
}`;
const COLOUR = `precision highp float; uniform float cut; uniform vec4 line; uniform vec3 ahead; in vec3 here; out vec4 colour;
void main() {
  if (line.a > 0.0) { colour = line; return; }
  if (here.z > cut) discard;
  vec3 side = normalize(cross(dFdx(here), dFdy(here)));
  float light = 0.45 + 0.35 * abs(dot(side, normalize(vec3(0.5, 0.3, 1.0)))) + 0.2 * abs(dot(side, ahead));
  colour = vec4(mix(vec3(0.72, 0.70, 0.66), vec3(0.86, 0.89, 0.94), clamp(here.z / 2.5, 0.0, 1.0)) * light, 1.0);
}`;

export const canDrawSolids = Boolean(document.createElement("canvas").getContext("webgl2"));

const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const ring = ([x, y]) => Array.from({ length: 48 }, (_, i) => Math.ceil(i / 2) * Math.PI / 12).flatMap((turn) => [x + RING_M * Math.cos(turn), y + RING_M * Math.sin(turn), FLOOR_M]);
const bytes = (text) => Uint8Array.from(atob(text), (each) => each.charCodeAt(0)).buffer;

export class Solid {
  constructor(box, canvas, cut) {
    Object.assign(this, { box, canvas, cut, source: null, turn: 0.5, tilt: 0.9, far: 20, target: [0, 0, 1], triangles: 0, lines: [], waits: false });
    if (!canDrawSolids) return;
    cut.addEventListener("input", () => {
      cut.nextElementSibling.textContent = `${cut.valueAsNumber.toFixed(1)} m`;
      this.#draw();
    });
    this.#prepare();
    this.#listen();
    new ResizeObserver(() => this.#draw()).observe(canvas);
  }

  hide() { this.box.hidden = true; this.source = null; }

  // `origin`: of the plan in the metres of the corners.
  show({ origin: [x, y], corners, faces }, shape, asked) {
    const { gl } = this, at = new Float32Array(bytes(corners)), indices = new Uint32Array(bytes(faces));
    for (let i = 0; i < at.length; i += 3) { at[i] -= x; at[i + 1] -= y; }
    this.triangles = indices.length;
    gl.bindVertexArray(this.body);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.corners);
    gl.bufferData(gl.ARRAY_BUFFER, at, gl.STATIC_DRAW);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    const [x1, y1, x2, y2] = shape.bounds;
    this.box.hidden = false;
    this.far = Math.hypot(x2 - x1, y2 - y1, 4) / Math.min(this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1), 1);
    this.target = [(x1 + x2) / 2, (y1 + y2) / 2, 1];
    this.aimed = String(asked?.at); // the whole level is shown at first
    this.mark(shape, asked);
  }

  // Draws the doors of the plan anew, and turns to the place of a question.
  mark(shape, asked) {
    const lines = shape.doors.flatMap(({ rings: [ring] }) => ring.flatMap((from, i) => {
      const to = ring[(i + 1) % ring.length];
      return [[...from, FLOOR_M], [...to, FLOOR_M], [...from, DOOR_M], [...to, DOOR_M], [...from, FLOOR_M], [...from, DOOR_M]].flat();
    }));
    this.doors = lines.length / 3;
    if (asked) {
      lines.push(...asked.at, FLOOR_M, ...asked.at, POLE_M, ...ring(asked.at));
      if (String(asked.at) !== this.aimed) this.target = [...asked.at, 1];
    }
    this.aimed = String(asked?.at);
    this.ends = lines.length / 3;
    const { gl } = this;
    gl.bindVertexArray(this.wires);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.points);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(lines), gl.DYNAMIC_DRAW);
    this.#draw();
  }

  #prepare() {
    const gl = this.gl = this.canvas.getContext("webgl2"), program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, PLACE], [gl.FRAGMENT_SHADER, COLOUR]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, `#version 300 es\n${text}`);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, "at");
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    this.uniform = Object.fromEntries(["eye", "right", "up", "ahead", "aspect", "far", "cut", "line"].map((name) => [name, gl.getUniformLocation(program, name)]));
    [this.body, this.corners] = this.#array();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    [this.wires, this.points] = this.#array();
  }

  #array() {
    const { gl } = this, array = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    return [array, buffer];
  }

  #draw() {
    if (this.waits || this.box.hidden) return;
    this.waits = true;
    requestAnimationFrame(() => { this.waits = false; this.#paint(); });
  }

  get #right() { return [Math.cos(this.turn), Math.sin(this.turn), 0]; }

  #paint() {
    const { gl, canvas, uniform, far, tilt, turn } = this;
    canvas.width = canvas.clientWidth * devicePixelRatio;
    canvas.height = canvas.clientHeight * devicePixelRatio;
    const ahead = [-Math.cos(tilt) * Math.sin(turn), Math.cos(tilt) * Math.cos(turn), -Math.sin(tilt)];
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniform3fv(uniform.eye, this.target.map((value, i) => value - far * ahead[i]));
    gl.uniform3fv(uniform.right, this.#right);
    gl.uniform3fv(uniform.up, cross(this.#right, ahead));
    gl.uniform3fv(uniform.ahead, ahead);
    gl.uniform1f(uniform.aspect, canvas.width / Math.max(canvas.height, 1));
    gl.uniform1f(uniform.far, 10 * far);
    gl.uniform1f(uniform.cut, this.cut.valueAsNumber);
    gl.uniform4f(uniform.line, 0, 0, 0, 0);
    gl.bindVertexArray(this.body);
    gl.drawElements(gl.TRIANGLES, this.triangles, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(this.wires);
    gl.uniform4f(uniform.line, 0.76, 0.09, 0.56, 1);
    gl.drawArrays(gl.LINES, 0, this.doors);
    gl.uniform4f(uniform.line, 0.85, 0.33, 0.12, 1);
    gl.drawArrays(gl.LINES, this.doors, this.ends - this.doors);
  }

  #rotate(across, up) {
    this.turn -= across;
    this.tilt = Math.min(Math.max(this.tilt + up, FLAT[0]), FLAT[1]);
    this.#draw();
  }

  #move(across, down) { // pixels
    const metres = (2 * this.far) / (LENS * Math.max(this.canvas.clientHeight, 1)), [x, y] = this.#right;
    this.target = [this.target[0] - metres * (across * x + down * y), this.target[1] - metres * (across * y - down * x), this.target[2]];
    this.#draw();
  }

  #zoom(factor) {
    this.far = Math.min(Math.max(this.far * factor, 1), 500);
    this.#draw();
  }

  #listen() {
    const held = new Map(), { canvas } = this; // where each finger is, or the mouse while its button is down
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.#zoom(event.deltaY > 0 ? 1.15 : 1 / 1.15); }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => { held.set(event.pointerId, event); canvas.setPointerCapture(event.pointerId); });
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => held.delete(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      const before = held.get(event.pointerId);
      if (!before) return;
      const [across, down] = [event.clientX - before.clientX, event.clientY - before.clientY];
      held.set(event.pointerId, event);
      const other = [...held.values()].find((each) => each.pointerId !== event.pointerId), apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
      if (other) this.#zoom(apart(before) / Math.max(apart(event), 1));
      if (other || event.shiftKey) this.#move(across, down);
      else this.#rotate(across * TURN, down * TURN);
    });
    const keys = {
      ArrowLeft: () => this.#rotate(-STEP, 0), ArrowRight: () => this.#rotate(STEP, 0), ArrowUp: () => this.#rotate(0, STEP), ArrowDown: () => this.#rotate(0, -STEP),
      "+": () => this.#zoom(1 / 1.15), "-": () => this.#zoom(1.15),
    };
    canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key]) return;
      event.preventDefault();
      event.stopPropagation();
      keys[event.key]();
    });
  }
}
