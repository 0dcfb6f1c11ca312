// Where a point that is drawn snaps to: ends and edges of what the plan has, and right angles to them.

export const segmentsOf = (shape) => [
  ...shape.rooms.flatMap(({ rings }) => rings), ...shape.doors.flatMap(({ rings }) => rings), ...shape.walls,
].flatMap((ring) => ring.map((from, i) => [from, ring[(i + 1) % ring.length]]));

const apart = ([a, b], [c, d]) => Math.hypot(a - c, b - d);

function nearestOn([from, to], [x, y]) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]], square = dx * dx + dy * dy || 1;
  const share = Math.min(1, Math.max(0, ((x - from[0]) * dx + (y - from[1]) * dy) / square));
  return [from[0] + share * dx, from[1] + share * dy];
}

function best(found, point, within) {
  let nearest = null, least = within;
  for (const each of found) {
    const far = apart(each, point);
    if (far <= least) [nearest, least] = [each, far];
  }
  return nearest;
}

// The directions that are right angles for a line from a point: the axes, and those of the edges beside the point.
function ways(from, segments, within) {
  const found = [[1, 0], [0, 1]];
  for (const segment of segments) {
    const length = apart(...segment);
    if (length < within || apart(nearestOn(segment, from), from) > within) continue;
    const [dx, dy] = [(segment[1][0] - segment[0][0]) / length, (segment[1][1] - segment[0][1]) / length];
    if (found.every(([a, b]) => Math.abs(a * dx + b * dy) < 0.9999)) found.push([dx, dy], [-dy, dx]);
  }
  return found;
}

function crossing([x, y], [dx, dy], [from, to]) {
  const [ex, ey] = [to[0] - from[0], to[1] - from[1]], whole = dx * ey - dy * ex;
  if (Math.abs(whole) < 1e-9) return null;
  const share = ((from[0] - x) * dy - (from[1] - y) * dx) / whole;
  return share < 0 || share > 1 ? null : [from[0] + share * ex, from[1] + share * ey];
}

// Returns the point and what it snapped to ("" if to nothing); `start` is the point before it, null for the first one.
export function snap(point, start, segments, within) {
  const end = best(segments.map(([from]) => from), point, within);
  if (end) return { point: end, kind: "end" };
  const edge = best(segments.map((segment) => nearestOn(segment, point)), point, within);
  if (start && apart(start, point) > within) {
    const rays = ways(start, segments, within).map((way) => {
      const far = (point[0] - start[0]) * way[0] + (point[1] - start[1]) * way[1];
      return { way, place: [start[0] + far * way[0], start[1] + far * way[1]] };
    }).filter(({ place }) => apart(place, point) <= within);
    rays.sort((one, other) => apart(one.place, point) - apart(other.place, point));
    if (rays.length) {
      const { way, place } = rays[0];
      const met = best(segments.map((segment) => crossing(start, way, segment)).filter(Boolean), point, within);
      return met ? { point: met, kind: "edge, right angle" } : { point: place, kind: "right angle" };
    }
  }
  return edge ? { point: edge, kind: "edge" } : { point, kind: "" };
}
