"use strict";
// Curves under the scrubber, linked to it: a click seeks. Each pixel shows the least and the largest
// value of its time, so that no peak of a long walk is lost.
const LEG_ROWS = ["LF", "RF", "LH", "RH"], INK_LINE = "#3a4350", FAINT = "#d5dbe2";
// From this share of a limit on the joint is marked on the robot.
const NEAR_LIMIT = 0.9, NEAREST = 0xc2185b;

// Which feet stand, one row a leg.
function drawStances(pen, standing, colours, [from, to], width, height) {
  const row = height / LEG_ROWS.length, at = (t) => width * (t - from) / (to - from);
  LEG_ROWS.forEach((leg, i) => {
    pen.fillStyle = colours[leg];
    for (const [start, end] of standing[leg] || []) {
      if (end < from || start > to) continue;
      const x = at(start);
      pen.fillRect(x, i * row + 0.1 * row, Math.max(at(end) - x, 0.5), 0.8 * row);
    }
  });
}

// Lines over time within a window; lines are { values, colour }.
function drawLines(pen, times, lines, [low, high], [from, to], width, height) {
  const x = (t) => width * (t - from) / (to - from);
  const y = (v) => height - 2 - (height - 4) * (v - low) / (high - low);
  const first = Math.max(countUpTo(times, from) - 1, 0);
  const last = Math.min(countUpTo(times, to) + 1, times.length);
  for (const { values, colour } of lines) {
    pen.strokeStyle = colour;
    pen.lineWidth = 1.4 * (window.devicePixelRatio || 1);
    pen.beginPath();
    let open = false, pixel = -1, least = 0, most = 0;
    const put = () => {
      if (!open) return;
      pen.lineTo(pixel, y(least));
      pen.lineTo(pixel, y(most));
    };
    for (let i = first; i < last; i++) {
      const value = values[i];
      if (Number.isNaN(value)) { put(); open = false; continue; }
      const here = Math.round(x(times[i]));
      if (!open) pen.moveTo(here, y(value));
      if (!open || here !== pixel) {
        put();
        pen.lineTo(here, y(value));
        least = most = value;
      }
      least = Math.min(least, value);
      most = Math.max(most, value);
      pixel = here;
      open = true;
    }
    put();
    pen.stroke();
  }
}

function makeCurves(THREE, viewer, world, data, legColours, duration, seek) {
  if (!data) return null;
  const el = (id) => document.getElementById(id), panel = el("curves");
  const times = columnsOf(data.times)[0], NOTHING = -999;
  const nan = (column) => column.map((v) => v < NOTHING ? NaN : v);
  const velocity = columnsOf(data.velocity), torque = data.torque && columnsOf(data.torque);
  const ofLegs = (columns) => LEG_ROWS.map((leg) => {
    const own = columns.filter((_, i) => data.legs[i] === leg);
    return { colour: legColours[leg], leg,
      values: times.map((_, n) => own.reduce((most, c) => Math.max(most, c[n]), 0)) };
  });
  const percent = (v) => `${Math.round(100 * v)} %`, mm = (v) => `${(1000 * v).toFixed(1)} mm`;
  const at = (values, time) => {
    const next = Math.min(countUpTo(times, time), times.length - 1), i = Math.max(next - 1, 0);
    const gap = times[next] - times[i], f = gap > 0 ? Math.min((time - times[i]) / gap, 1) : 0;
    return f > 0 ? values[i] + f * (values[next] - values[i]) : values[i];
  };
  // The joint that uses most of its limit.
  const fullest = (columns, time) => {
    let best = 0, share = -1;
    columns.forEach((column, i) => {
      const now = at(column, time);
      if (now > share) [best, share] = [i, now];
    });
    return { joint: best, share };
  };
  const told = (columns) => (time) => {
    const { joint, share } = fullest(columns, time);
    return `${data.joints[joint]} ${percent(share)}`;
  };
  const standing = (t) => LEG_ROWS.filter((leg) => data.standing[leg].some(([a, b]) => a <= t && t < b));
  const charts = [{ name: "feet on the ground", stances: true, now: (t) => standing(t).join(" ") }];
  charts.push({ name: "joint velocity, share of limit", lines: ofLegs(velocity), marks: [1],
    now: told(velocity), percent: true });
  if (torque) {
    charts.push({ name: "joint torque, share of limit", lines: ofLegs(torque), marks: [1],
      now: told(torque), percent: true });
  }
  const single = (name, table, marks) => {
    const values = nan(columnsOf(table)[0]);
    charts.push({ name, lines: [{ values, colour: INK_LINE }], marks,
      now: (t) => { const v = at(values, t); return Number.isNaN(v) ? "none" : mm(v); } });
    return values;
  };
  const margins = data.margin && single(`stability margin of the ${data.marginName}`, data.margin, [0, data.promised]);
  if (data.forces) {
    // The page has the legs in the order of gaitopt.LEGS.
    const forces = columnsOf(data.forces), lines = LEG_ROWS.map((leg) => (
      { leg, colour: legColours[leg], values: forces[Object.keys(data.standing).indexOf(leg)] }));
    const words = (t) => lines.map(({ leg, values }) => `${leg} ${Math.round(at(values, t))}`);
    charts.push({ name: "vertical force on each foot [N]", marks: [0], lines,
      now: (t) => words(t).join("  ") });
  }
  if (data.clearance) single("legs and trunk above the ground", data.clearance, [0]);
  for (const chart of charts) {
    const box = document.createElement("div"), head = document.createElement("div");
    chart.canvas = document.createElement("canvas");
    chart.told = document.createElement("b");
    head.append(chart.name, chart.told);
    box.append(head, chart.canvas);
    box.className = "chart";
    panel.append(box);
    if (!chart.lines) continue;
    const every = [...chart.marks];
    for (const { values } of chart.lines) for (const v of values) if (!Number.isNaN(v)) every.push(v);
    let low = Infinity, high = -Infinity;
    for (const v of every) { low = Math.min(low, v); high = Math.max(high, v); }
    chart.range = [low, high > low ? high + 0.05 * (high - low) : low + 1];
  }
  for (const note of data.notes) {
    const line = document.createElement("div");
    line.className = "note";
    line.textContent = note;
    panel.append(line);
  }
  const cursor = document.createElement("div");
  cursor.className = "cursor";
  panel.append(cursor);

  // ---- the joint that limits, on the robot
  const halo = new THREE.Mesh(new THREE.SphereGeometry(1, 20, 14), new THREE.MeshBasicMaterial(
    { color: 0xff7a00, opacity: 0.55, transparent: true, depthTest: false }));
  halo.renderOrder = 20;
  halo.visible = false;
  const frames = data.frames.map((frame) => viewer.scene_tree.find(frame.split("/")).object);
  // Where legs and trunk are nearest to the ground: a stick from there straight down.
  const nearest = data.nearest && columnsOf(data.nearest);
  const gaps = data.clearance && columnsOf(data.clearance)[0], stick = new THREE.Mesh(
    new THREE.CylinderGeometry(1, 1, 1, 8).rotateX(Math.PI / 2),
    new THREE.MeshBasicMaterial({ color: NEAREST, depthTest: false }));
  stick.renderOrder = 19;
  stick.name = "nearest";
  if (nearest) world.add(stick);
  function measure(time) {
    if (!nearest) return;
    const i = Math.max(countUpTo(times, time) - 1, 0), gap = Math.max(at(gaps, time), 1e-4);
    stick.position.set(nearest[0][i], nearest[1][i], nearest[2][i] - gap / 2);
    stick.scale.set(0.004, 0.004, gap);
  }
  const curves = { open: false, zoomed: false, limiting: null, charts };
  // The margin of this instant. Two feet span a line: there is no margin to speak of.
  curves.margin = (time) => {
    const now = margins ? at(margins, time) : NaN;
    return Number.isNaN(now) || standing(time).length < 3 ? "" : mm(now);
  };
  function highlight(time) {
    const most = [velocity, ...torque ? [torque] : []].map((columns) => fullest(columns, time))
      .reduce((a, b) => b.share > a.share ? b : a);
    halo.visible = most.share >= NEAR_LIMIT;
    curves.limiting = halo.visible ? data.joints[most.joint] : null;
    if (halo.visible && halo.parent !== frames[most.joint]) frames[most.joint].add(halo);
  }

  // ---- drawing
  let shown = [0, duration], painted = "";
  function windowAt(time) {
    if (!curves.zoomed) return [0, duration];
    const wide = Math.max(Math.min(4, duration), duration / 24);
    const from = Math.min(Math.max(time - wide / 2, 0), duration - wide);
    return [from, from + wide];
  }
  function paint() {
    const scale = window.devicePixelRatio || 1;
    for (const chart of charts) {
      const { canvas } = chart, width = Math.max(1, Math.round(canvas.clientWidth * scale));
      const height = Math.max(1, Math.round(canvas.clientHeight * scale));
      canvas.width = width;
      canvas.height = height;
      const pen = canvas.getContext("2d");
      if (chart.stances) { drawStances(pen, data.standing, legColours, shown, width, height); continue; }
      const [low, high] = chart.range;
      pen.strokeStyle = FAINT;
      pen.setLineDash([4 * scale, 4 * scale]);
      for (const mark of chart.marks) {
        const y = height - 2 - (height - 4) * (mark - low) / (high - low);
        pen.beginPath();
        pen.moveTo(0, y);
        pen.lineTo(width, y);
        pen.strokeStyle = mark ? "#9aa6b3" : FAINT;
        pen.stroke();
      }
      pen.setLineDash([]);
      drawLines(pen, times, chart.lines, chart.range, shown, width, height);
    }
  }
  curves.update = (time) => {
    highlight(time);
    measure(time);
    if (!curves.open) return;
    shown = windowAt(time);
    const key = `${shown} ${panel.clientWidth} ${panel.clientHeight}`;
    if (key !== painted) paint();
    painted = key;
    cursor.style.left = `${100 * (time - shown[0]) / (shown[1] - shown[0])}%`;
    for (const chart of charts) {
      const text = chart.now(time);
      if (chart.told.textContent !== text) chart.told.textContent = text;
    }
  };
  curves.show = (open, time) => {
    curves.open = open;
    panel.hidden = !open;
    painted = "";
    curves.update(time);
  };
  curves.zoom = (time) => { curves.zoomed = !curves.zoomed; curves.update(time); };
  curves.halo = (size) => halo.scale.setScalar(size);

  // ---- a click, or a finger that is drawn along, seeks
  const seekTo = (event) => {
    const { left, width } = panel.getBoundingClientRect();
    const part = Math.min(Math.max((event.clientX - left) / width, 0), 1);
    seek(shown[0] + part * (shown[1] - shown[0]));
  };
  panel.addEventListener("pointerdown", (event) => {
    panel.setPointerCapture(event.pointerId);
    seekTo(event);
  });
  panel.addEventListener("pointermove", (event) => {
    if (panel.hasPointerCapture(event.pointerId)) seekTo(event);
  });
  return curves;
}
