// Two plans at one scale: what is zoomed or moved in the one is zoomed and moved in the other.
import { ask, say } from "./api.js";
import { Drawing } from "./drawing.js";

const places = [...document.querySelectorAll("#pair .drawing")];

async function drawn(place) {
  const base = `/api/${place.dataset.name}/plans/${place.dataset.plan}`;
  const shape = await ask(`${base}/shape`), drawing = new Drawing(place, shape);
  place.removeAttribute("aria-busy");
  for (const layer of ["grid", "frame", "clearance", "reach", "boxes"]) drawing.show(layer, false);
  if (!shape.rooms.length) drawing.rooms(await ask(`${base}/rooms`));
  return drawing;
}

Promise.all(places.map(drawn)).then((both) => {
  const [wide, high] = [2, 3].map((side) => Math.max(...both.map((each) => each.home[side])));
  for (const each of both) {
    const [x, y, w, h] = each.home;
    each.home = [x - (wide - w) / 2, y - (high - h) / 2, wide, high];
    each.look(each.home);
  }
  const looks = both.map((each) => each.look.bind(each));
  both.forEach((each, i) => {
    const other = both[1 - i];
    each.look = (view) => {
      looks[i](view);
      looks[1 - i]([other.home[0] + view[0] - each.home[0], other.home[1] + view[1] - each.home[1], view[2], view[3]]);
    };
  });
}).catch((error) => say(`The plans could not be drawn: ${error.message}`));
