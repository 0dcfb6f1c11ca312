// Frames as they come over the socket (houseexpo/service/drive/frames.py), and the map that they add up to.
const HEAD = 44;
const COLOURS = [[215, 221, 229], [255, 255, 255], [47, 52, 59]]; // unknown, free, obstacle
const FINE = 32;

export function readFrame(buffer) {
  const view = new DataView(buffer);
  const short = (at) => view.getUint16(at, true);
  const real = (at) => view.getFloat32(at, true);
  const flags = view.getUint8(1);
  const [row, col, rows, cols, bodies, beams] = [32, 34, 36, 38, 40, 42].map(short);
  const found = {
    collided: (flags & 1) > 0, ended: (flags & 2) > 0, success: (flags & 4) > 0, collisions: short(2),
    number: view.getUint32(4, true), x: real(8), y: real(12), heading: real(16), explored: real(20), coverage: real(24),
    path: real(28), row, col, rows, cols, bodies: [], ranges: [], runs: [],
  };
  let at = HEAD;
  for (let i = 0; i < bodies; i++, at += 12) found.bodies.push([real(at), real(at + 4), real(at + 8)]);
  for (let i = 0; i < beams; i++, at += 2) found.ranges.push(short(at) / FINE);
  for (; at + 1 < buffer.byteLength; at += 2) found.runs.push(short(at));
  return found;
}

// Paints the changed rectangle on a canvas of a pixel a cell.
export function paintMap(context, frame) {
  if (frame.rows === 0) return;
  const part = context.createImageData(frame.cols, frame.rows);
  let at = 0;
  for (const run of frame.runs) {
    const [red, green, blue] = COLOURS[run >> 14];
    for (let left = run & 0x3fff; left > 0; left--, at += 4) {
      part.data[at] = red;
      part.data[at + 1] = green;
      part.data[at + 2] = blue;
      part.data[at + 3] = 255;
    }
  }
  context.putImageData(part, frame.col, frame.row);
}
