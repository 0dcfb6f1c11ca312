// One robot: its socket, its scene, its driver, and how the drive ended.
import { readFrame } from "./frames.js";
import { Scene } from "./scene.js";

const SAVED = 2;
const ABOUT = 90; // functions that a first drive compiles, with an explorer and people
const WHYS = {
  seen: "The whole house is seen", done: "The explorer is done", steps: "Time is up", you: "Finished",
};

export class Panel {
  constructor(template, { address, plan }, driver) {
    this.element = template.content.firstElementChild.cloneNode(true);
    this.one = (name) => this.element.querySelector(name);
    this.driver = this.one(".driver");
    this.scene = new Scene(this.one(".map"));
    Object.assign(this, { address, plan, hello: null, held: false, moving: "0 0" });
    this.driver.value = driver;
    for (const [name, work] of Object.entries({
      save: () => this.save(), hold: () => this.hold(), finish: () => this.finish(), again: () => this.again(), retry: () => this.again(),
    })) for (const button of this.element.querySelectorAll(`.${name}`)) button.addEventListener("click", work);
  }

  get byHand() { return this.driver.value === "you"; }

  // Sets the robot down anew; `options` are those of the form.
  begin(options) {
    const { pace, ...told } = options;
    this.options = options;
    this.#open(pace, { do: "start", plan: this.plan, driver: this.driver.value, ...told });
  }

  again() { this.begin(this.options); }

  #open(pace, first) {
    this.end();
    Object.assign(this, { hello: null, pace, held: false, moving: "0 0", failed: false });
    this.scene.clear();
    Object.assign(this.element.dataset, { state: "waiting", frame: 0 });
    this.#facts({ coverage: 0, explored: 0, path: 0, bumps: 0, steps: 0 });
    this.#say("");
    this.one(".result").hidden = true;
    this.one(".announced").textContent = "";
    this.one(".hint").hidden = true;
    this.#wait("Placing the robot…");
    Object.assign(this.one(".hold"), { hidden: this.byHand, textContent: "Pause", disabled: false });
    this.one(".finish").disabled = true;
    const socket = new WebSocket(new URL(this.address, location.href.replace(/^http/, "ws")));
    socket.binaryType = "arraybuffer";
    let opened = false; // a server that has no room for another socket does not open it, and cannot say why
    socket.addEventListener("open", () => { opened = true; this.#send(first); });
    socket.addEventListener("message", (event) => { if (socket === this.socket) this.#hear(event.data); });
    socket.addEventListener("close", (event) => {
      if (socket !== this.socket) return;
      const ended = this.element.dataset.state === "ended";
      if (!ended) this.element.dataset.state = "closed";
      if (!this.failed && !ended) {
        this.#fail(event.reason || (opened ? "The server has ended the drive. Start again."
          : "The robot could not start: there are too many robots, or the server has stopped. Close other Drive pages, then start again."));
      }
    });
    this.socket = socket;
  }

  end() {
    const { socket } = this;
    this.socket = null;
    socket?.close();
  }

  // Moves by shares of the full speed, ahead and to the left; an explorer's robot is taken over meanwhile.
  move(linear, angular) {
    const moving = `${linear} ${angular}`;
    if (!this.hello || moving === this.moving) return;
    this.moving = moving;
    this.one(".hint").hidden = true;
    this.#send({ do: "move", linear, angular });
  }

  hold() {
    if (this.byHand || !this.hello || this.element.dataset.state === "ended") return;
    this.held = !this.held;
    this.one(".hold").textContent = this.held ? "Continue" : "Pause";
    this.#send({ do: "pace", steps_per_s: this.held ? 0 : this.pace });
  }

  save() {
    if (this.hello) this.#send({ do: "save" });
  }

  finish() {
    if (this.hello && this.element.dataset.state === "driving") this.#send({ do: "finish" });
  }

  #send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  #say(text, bad = false) {
    this.one(".said").textContent = text;
    this.one(".said").classList.toggle("bad", bad);
  }

  #wait(words, details = "", share = null) {
    this.one(".waiting").hidden = false;
    this.one(".waiting-words").textContent = words;
    this.one(".waiting-details").textContent = details;
    const bar = this.one(".waiting progress");
    bar.hidden = share === null;
    if (share !== null) bar.value = share;
    this.one(".retry").hidden = true;
  }

  #fail(words) {
    this.failed = true;
    this.element.dataset.state = "closed";
    this.#wait(words);
    this.one(".retry").hidden = false;
    this.#say(words, true);
  }

  #hear(data) {
    if (typeof data === "string") {
      const told = JSON.parse(data);
      if (told.error) this.#fail(told.error);
      else if (told.preparing) this.#prepare(told.preparing);
      else if (told.finish) this.#finished(told.finish);
      else this.#start(told.hello);
    } else if (new Uint8Array(data, 0, 1)[0] === SAVED) this.#download(data.slice(1));
    else this.#show(readFrame(data));
  }

  // What takes so long: kernels are compiled on a machine's first drive, or the house is large.
  #prepare({ compiling, functions, seconds }) {
    const since = `${Math.round(seconds)} s so far`;
    if (!compiling) this.#wait("Preparing the house…", `Large houses take a few seconds (${since}).`);
    else {
      const share = 0.97 * (1 - Math.exp(-2.2 * functions / ABOUT));
      this.#wait("First drive on this machine: compiling the simulator",
        `${functions} functions, ${since}. It takes 20 to 60 s, once; a slow machine needs longer. What is compiled is kept on disk.`, share);
    }
  }

  #start(hello) {
    this.hello = hello;
    this.scene.begin(hello);
    this.element.dataset.state = "driving";
    this.one(".finish").disabled = false;
    if (!this.byHand) this.#send({ do: "pace", steps_per_s: this.pace });
  }

  #show(frame) {
    this.one(".waiting").hidden = true;
    if (this.byHand && frame.number === 1) this.one(".hint").hidden = false;
    this.scene.show(frame);
    this.frame = frame;
    this.element.dataset.frame = frame.number;
    this.element.dataset.steps = frame.steps;
    this.#facts(frame);
    this.#send({ do: "seen", number: frame.number });
  }

  #facts({ coverage, explored, path, bumps, steps }) {
    const share = Math.min(coverage, 1);
    this.one(".seen").textContent = percent(share);
    this.one(".bar-seen").style.width = `${100 * share}%`;
    this.one(".area").textContent = `${explored.toFixed(1)} m²`;
    this.one(".way").textContent = `${path.toFixed(1)} m`;
    this.one(".bumps").textContent = bumps;
    this.one(".time").textContent = duration(steps * (this.hello?.step_s ?? 0));
  }

  #finished(found) {
    this.element.dataset.state = "ended";
    const words = WHYS[found.why];
    const counts = [
      [percent(found.coverage), "seen"], [`${found.explored_m2.toFixed(1)} m²`, "mapped"], [`${found.path_m.toFixed(1)} m`, "driven"],
      [found.bumps, found.bumps === 1 ? "bump" : "bumps"], [found.steps.toLocaleString("en"), "steps"], [duration(found.time_s), "time"],
    ];
    this.one(".result-words").textContent = words;
    this.one(".figures").replaceChildren(...counts.map(([value, name]) => figure(value, name)));
    this.one(".hint").hidden = true;
    this.one(".result").hidden = false;
    this.one(".finish").disabled = this.one(".hold").disabled = true;
    this.#say("");
    this.one(".announced").textContent = `${words}: ${counts.map(([value, name]) => `${value} ${name}`).join(", ")}.`;
  }

  #download(data) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([data], { type: "application/zip" }));
    link.download = `${this.plan}-${this.driver.value}.zip`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    this.#say("Path and map saved.");
  }
}

const percent = (share) => `${Math.floor(100 * share + 1e-6)}%`;

function duration(seconds) {
  const whole = Math.round(seconds);
  return whole < 100 ? `${whole} s` : `${Math.floor(whole / 60)} min ${whole % 60} s`;
}

function figure(value, name) {
  const place = document.createElement("div");
  for (const [kind, text] of [["dt", name], ["dd", value]]) place.append(Object.assign(document.createElement(kind), { textContent: text }));
  return place;
}
