"use strict";
// Moves frames along their keyframes. This is done here and not by three.js, whose animations keep
// one mixer a frame and quaternions where one angle is enough.
function makeMotion(THREE, viewer, tracks) {
  const a = new THREE.Quaternion(), b = new THREE.Quaternion();
  const setters = {
    position: (object, [x, y, z], i, j, f) => object.position.set(
      x[i] + f * (x[j] - x[i]), y[i] + f * (y[j] - y[i]), z[i] + f * (z[j] - z[i])),
    quaternion: (object, [x, y, z, w], i, j, f) => {
      a.set(x[i], y[i], z[i], w[i]).normalize();
      b.set(x[j], y[j], z[j], w[j]).normalize();
      object.quaternion.copy(a).slerp(b, f);
    },
    // A turn about a fixed axis: from one quaternion towards another by an angle.
    turn: (object, [angle], i, j, f, [u, v]) => {
      const now = angle[i] + f * (angle[j] - angle[i]), c = Math.cos(now), s = Math.sin(now);
      object.quaternion.set(...u.map((part, k) => c * part + s * v[k]));
    },
  };
  const moved = tracks.map(({ frame, kind, times, values, plane }) => ({
    object: viewer.scene_tree.find(frame).object, set: setters[kind], plane,
    times: columnsOf(times)[0], values: columnsOf(values),
  }));
  return (time) => {
    for (const { object, set, plane, times, values } of moved) {
      const next = countUpTo(times, time), i = Math.max(next - 1, 0);
      const j = Math.min(next, times.length - 1), gap = times[j] - times[i];
      set(object, values, i, j, gap > 0 ? Math.min(Math.max((time - times[i]) / gap, 0), 1) : 0, plane);
    }
    viewer.set_dirty();
  };
}
