"use strict";
// A coloured dot beside a word.
function dot(colour) {
  const mark = document.createElement("i");
  mark.style.background = colour;
  return mark;
}

// How far up a box goes so that it covers none of those that were placed before it.
function liftedAbove(taken, x, y, wide, tall) {
  let bottom = y;
  for (let tries = 0; tries < taken.length; tries++) {
    const below = taken.find((other) => Math.abs(other.x - x) < (other.wide + wide) / 2
      && other.bottom > bottom - tall && other.bottom - other.tall < bottom);
    if (!below) break;
    bottom = below.bottom - below.tall - 2;
  }
  taken.push({ x, bottom, wide, tall });
  return bottom;
}

// Names above frames: of runners with the steps they have done, of feet, and of what happened.
function makeLabels(THREE, viewer, labels) {
  const place = new THREE.Vector3(), camera = viewer.camera;
  const boxes = labels.map((label) => {
    const box = document.createElement("div"), name = document.createElement("b");
    const below = document.createElement("span");
    name.append(dot(label.colour), label.name);
    box.className = label.kind === "runner" ? "label" : `label ${label.kind}`;
    box.append(name, below);
    document.getElementById("scene").append(box);
    const frame = viewer.scene_tree.find(label.frame.split("/").filter(Boolean)).object;
    return { label, box, below, frame };
  });
  const all = { names: true };
  all.place = (time) => {
    camera.updateMatrixWorld();
    const taken = [], { clientWidth: wide, clientHeight: tall } = viewer.dom_element;
    for (const { label, box, below, frame } of boxes) {
      frame.updateWorldMatrix(true, false);
      place.setFromMatrixPosition(frame.matrixWorld);
      place.y += label.lift;
      place.project(camera);
      const x = (place.x + 1) / 2 * wide, y = (1 - place.y) / 2 * tall;
      const lift = label.kind === "foot" ? "translate(-50%, 35%)" : "translate(-50%, -100%)";
      // What happened is told at the edge, too, where its place is outside of the view.
      let down = label.kind === "event" ? Math.min(Math.max(y, 40), tall) : y;
      if (label.kind === "runner" && place.z <= 1) {
        down = liftedAbove(taken, x, y, box.offsetWidth, box.offsetHeight);
      }
      box.style.transform = `translate(${x}px, ${down}px) ${lift}`;
      box.style.zIndex = String(Math.round(1e6 * (1 - place.z)));
      const done = time >= label.since;
      box.hidden = place.z > 1 || label.kind === "event" && !done
        || label.kind === "foot" && !all.names;
      if (label.kind !== "runner") continue;
      box.classList.toggle("done", done);
      below.textContent = done ? label.result
        : `${countUpTo(label.landings, time)} of ${label.landings.length} steps`;
    }
  };
  return all;
}
