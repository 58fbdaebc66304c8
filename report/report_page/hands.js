// SPDX-License-Identifier: Apache-2.0
// Mouse, fingers and keys on the 3D view.

function listenToHands(viewer) {
  listenToPointers(viewer);
  listenToWheel(viewer);
  viewer.canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  viewer.canvas.addEventListener("keydown", (event) => onKey(viewer, event));
  viewer.canvas.addEventListener("dblclick", (event) => {
    const index = viewer.cameraAt(event.offsetX, event.offsetY);
    if (index >= 0) return viewer.lookThrough(index);
    const target = viewer.pointUnder(event.offsetX, event.offsetY);
    if (target) viewer.fly({ target });
  });
}

// Middle of the fingers and the sum of their distances from it.
function gatherFingers(fingers) {
  const all = [...fingers.values()], middle = scale(all.map((f) => [...f, 0]).reduce(add), 1 / all.length);
  const spread = all.reduce((sum, f) => sum + Math.hypot(f[0] - middle[0], f[1] - middle[1]), 0);
  return { count: all.length, middle, spread };
}

// One finger or button turns; two fingers, the right or the middle button, or Shift move; two fingers zoom as well.
function dragTo(viewer, before, now, event) {
  const [dx, dy] = sub(now.middle, before.middle);
  if (now.count > 1 || event.buttons & 6 || event.shiftKey) viewer.move(dx, dy);
  else viewer.turn((dx * 5) / viewer.canvas.clientHeight, (dy * 5) / viewer.canvas.clientHeight);
  if (now.count > 1 && now.spread > 0) viewer.zoom(before.spread / now.spread);
}

function hover(viewer, index, x, y) {
  viewer.canvas.classList.toggle("pointing", index >= 0);
  if (index !== viewer.frusta.hovered) {
    viewer.frusta.hovered = index;
    viewer.draw();
  }
  viewer.on.hover(index, x, y);
}

function listenToPointers(viewer) {
  const canvas = viewer.canvas, fingers = new Map(), place = (event) => [event.offsetX, event.offsetY];
  let moved = 0, hands = null;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    if (!fingers.size) moved = 0;
    fingers.set(event.pointerId, place(event));
    hands = gatherFingers(fingers);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId)) return hover(viewer, viewer.cameraAt(...place(event)), ...place(event));
    fingers.set(event.pointerId, place(event));
    const now = gatherFingers(fingers), [dx, dy] = sub(now.middle, hands.middle);
    moved += Math.abs(dx) + Math.abs(dy) + Math.abs(now.spread - hands.spread);
    if (moved > 4) {
      canvas.classList.add("turning");
      dragTo(viewer, hands, now, event);
    }
    hands = now;
  });
  const release = (event) => {
    if (!fingers.delete(event.pointerId)) return;
    if (fingers.size) return void (hands = gatherFingers(fingers));
    canvas.classList.remove("turning");
    const still = event.type === "pointerup" && event.button === 0 && moved <= 4;
    const index = still ? viewer.cameraAt(...place(event)) : -1;
    if (index >= 0) viewer.on.select(index);
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("pointerleave", () => hover(viewer, -1, 0, 0));
}

function listenToWheel(viewer) {
  viewer.canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    viewer.zoom(Math.exp(clamp(event.deltaY * lines, -200, 200) * (event.ctrlKey ? 0.01 : 0.0015)));
  }, { passive: false });
}

function onKey(viewer, event) {
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const arrow = arrows[event.key], step = (by) => viewer.on.step(by);
  if (arrow && event.shiftKey) viewer.move(-40 * arrow[0], -40 * arrow[1]);
  else if (arrow) viewer.turn(-0.12 * arrow[0], -0.12 * arrow[1]);
  else {
    const keys = { "+": () => viewer.zoom(0.85), "=": () => viewer.zoom(0.85), "-": () => viewer.zoom(1 / 0.85),
                   n: () => step(1), p: () => step(-1), l: () => viewer.lookThrough(viewer.frusta.selected),
                   r: () => viewer.goHome() };
    const action = keys[event.key.toLowerCase()] ?? viewer.on.keys?.[event.key.toLowerCase()];
    if (!action) return;
    action();
  }
  event.preventDefault();
}
