// Frames as they come over the socket (houseexpo/service/drive/frames.py).
const HEAD = 48;
const FINE = 32;
const BODY = 24;

export function readFrame(buffer) {
  const view = new DataView(buffer);
  const short = (at) => view.getUint16(at, true);
  const real = (at) => view.getFloat32(at, true);
  const flags = view.getUint8(1);
  const [row, col, rows, cols, bodies, beams] = [36, 38, 40, 42, 44, 46].map(short);
  const found = {
    collided: (flags & 1) > 0, ended: (flags & 2) > 0, success: (flags & 4) > 0, bumps: short(2),
    number: view.getUint32(4, true), steps: view.getUint32(8, true), x: real(12), y: real(16), heading: real(20),
    explored: real(24), coverage: real(28), path: real(32), row, col, rows, cols, bodies: [], ranges: [], runs: [],
  };
  let at = HEAD;
  for (let i = 0; i < bodies; i++, at += BODY) {
    const [number, x, y, radius, across, down] = [0, 4, 8, 12, 16, 20].map((offset) => real(at + offset));
    found.bodies.push({ number, x, y, radius, across, down });
  }
  for (let i = 0; i < beams; i++, at += 2) found.ranges.push(short(at) / FINE);
  for (; at + 1 < buffer.byteLength; at += 2) found.runs.push(short(at));
  return found;
}

// The map that frames add up to: what each cell is, and which of them are known.
export class CellMap {
  constructor(rows, cols) {
    Object.assign(this, { rows, cols, cells: new Uint8Array(rows * cols), box: null });
  }

  // Takes what changed; `box` is then what is known: [left, top, right, bottom] in cells.
  add({ row, col, rows, cols, runs }) {
    if (rows === 0) return;
    let at = 0;
    for (const run of runs) {
      const kind = run >> 14;
      for (let left = run & 0x3fff; left > 0; left--, at++) {
        this.cells[(row + Math.floor(at / cols)) * this.cols + col + at % cols] = kind;
      }
    }
    const [left, top, right, bottom] = this.box ?? [col, row, col + cols, row + rows];
    this.box = [Math.min(left, col), Math.min(top, row), Math.max(right, col + cols), Math.max(bottom, row + rows)];
  }

  // Paints a rectangle on a canvas of a pixel a cell; `colours` are [red, green, blue] of unknown, free and obstacle.
  paint(context, colours, { row, col, rows, cols }) {
    if (rows === 0) return;
    const part = context.createImageData(cols, rows);
    let at = 0;
    for (let y = row; y < row + rows; y++) {
      for (let x = col; x < col + cols; x++, at += 4) {
        const [red, green, blue] = colours[this.cells[y * this.cols + x]];
        part.data[at] = red;
        part.data[at + 1] = green;
        part.data[at + 2] = blue;
        part.data[at + 3] = 255;
      }
    }
    context.putImageData(part, col, row);
  }
}
