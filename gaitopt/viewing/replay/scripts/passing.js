"use strict";
// What is shown for some time only, for instance the support polygon of a phase. It is made when its
// time comes and let go afterwards, so that a long walk plays as smoothly as a short one.
function makePassing(THREE, viewer, groups, meshOf) {
  const shown = groups.map(({ frame, frames }) => ({
    above: viewer.scene_tree.find(frame).object, frames, starts: frames.map((f) => f.start),
    now: -1, group: null,
  }));
  function change(one, next) {
    if (one.group) {
      one.above.remove(one.group);
      one.group.traverse((mesh) => {
        if (mesh.geometry) mesh.geometry.dispose();
        if (mesh.material) mesh.material.dispose();
      });
    }
    one.now = next;
    one.group = null;
    if (next < 0) return;
    one.group = new THREE.Group();
    one.group.name = one.frames[next].name;
    for (const part of one.frames[next].parts) one.group.add(meshOf(part));
    one.above.add(one.group);
  }
  const update = (time) => {
    for (const one of shown) {
      let next = countUpTo(one.starts, time) - 1;
      if (next >= 0 && time >= one.frames[next].end) next = -1;
      if (next !== one.now) change(one, next);
    }
  };
  // Names of what is shown, by the frame above it.
  update.names = () => shown.map(({ group }) => group ? group.name : "");
  return update;
}
