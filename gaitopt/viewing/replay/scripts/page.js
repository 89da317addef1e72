"use strict";
(() => {
  const el = (id) => document.getElementById(id);
  const read = (id) => JSON.parse(el(id).textContent);
  const data = read("data");
  const THREE = MeshCat.THREE;
  const BACKDROP = 0xecf0f4, FRAME = 1 / 30;
  document.querySelector("#about h1").textContent = document.title;

  let viewer;
  try {
    viewer = new MeshCat.Viewer(el("meshcat-pane"), false);
  } catch (error) {
    el("problem").hidden = false;
    el("problem").textContent = "This replay needs WebGL, which this browser does not offer.";
    return;
  }
  // meshcat's viewer takes the window's height for that of its pane.
  const resize = viewer.set_3d_pane_size.bind(viewer), pane = viewer.dom_element;
  viewer.set_3d_pane_size = () => resize(pane.clientWidth, pane.clientHeight);
  for (const text of read("commands")) viewer.handle_command_bytearray(bytesOf(text));

  // ---- the scene
  const hash = new URLSearchParams(location.hash.slice(1));
  const view = makeCamera(THREE, viewer, data);
  // Without a graphics card most of the time goes into shadows.
  const shine = makeLight(THREE, viewer, data, view, BACKDROP, !hash.has("no-shadows"));
  const sharpen = makeSharpness(viewer, hash);
  const meshOf = drawGround(THREE, viewer, data.ground);
  const move = makeMotion(THREE, viewer, data.tracks);
  const pass = makePassing(THREE, viewer, data.passing, meshOf);
  const labels = makeLabels(THREE, viewer, data.labels);

  // ---- time
  const state = { time: 0, playing: false, speed: data.speed, follow: false };
  const starts = data.captions.map((m) => m[0]);
  const curves = makeCurves(THREE, viewer, view.world, data.curves, data.legColours, data.duration,
    (time) => seek(time));
  if (curves) curves.halo(0.08 * data.followRadius);

  const captionAt = (time) => Math.max(0, countUpTo(starts, time) - 1);

  function clock(seconds) {
    const minutes = Math.floor(seconds / 60), rest = seconds - 60 * minutes;
    return `${minutes}:${rest.toFixed(data.duration < 20 ? 2 : 1).padStart(data.duration < 20 ? 5 : 4, "0")}`;
  }

  // Only what changes is written: each writing lets the browser lay out the page anew.
  const written = {};
  function write(name, value, put) {
    if (written[name] !== value) put(value);
    written[name] = value;
  }

  function seek(time) {
    state.time = Math.min(Math.max(time, 0), data.duration);
    move(state.time);
    pass(state.time);
    shine(view.track());
    const [, label, , mark] = data.captions[captionAt(state.time)] || [0, "", "", ""];
    const margin = curves ? curves.margin(state.time) : "";
    write("phase", `${mark} ${label}${margin && `, margin ${margin}`}`, () => el("phase")
      .replaceChildren(...(mark ? [dot(mark)] : []), label + (margin && `, margin ${margin}`)));
    write("clock", `${clock(state.time)} / ${clock(data.duration)}`,
      (text) => { el("clock").textContent = text; });
    el("scrub").value = data.duration > 0 ? Math.round(1e6 * state.time / data.duration) : 0;
    if (curves) curves.update(state.time);
  }

  function setPlaying(playing) {
    if (playing && state.time >= data.duration) seek(0);
    state.playing = playing && data.duration > 0;
    sharpen(!state.playing);
    el("play").classList.toggle("playing", state.playing);
  }

  function setSpeed(speed) {
    state.speed = speed;
    el("speed").value = String(speed);
  }

  function setFollow(follow) {
    state.follow = view.follow = follow && view.follower !== null;
    el("follow").setAttribute("aria-pressed", String(state.follow));
    view.reset();
  }

  function setView(name) {
    view.from = PRESETS[name] || data.viewFrom;
    el("view").value = PRESETS[name] ? name : "first";
    view.reset();
  }

  function setCurves(open) {
    if (!curves) return;
    curves.show(open, state.time);
    el("more").setAttribute("aria-pressed", String(open));
    fit();
  }

  // The scene ends where the curves begin; without them it goes on behind the bar.
  function fit() {
    const low = curves && curves.open ? el("bar").offsetHeight + 8 : 0;
    el("scene").style.bottom = `${low}px`;
    viewer.set_3d_pane_size();
    // In wide windows the robot is drawn beside the heading, and not behind it.
    const { clientWidth: wide, clientHeight: tall } = pane, about = el("about");
    const beside = wide >= 900 && !about.classList.contains("folded") ? 0.42 * about.offsetWidth : 0;
    viewer.camera.setViewOffset(wide, tall, -beside, 0, wide, tall);
    if (view.moved) viewer.set_dirty(); else view.reset();
  }

  function draw() {
    viewer.render();
    labels.place(state.time);
  }

  let last;
  function frame(now) {
    const passed = Math.min((now - (last === undefined ? now : last)) / 1000, 0.25);
    last = now;
    if (state.playing) {
      seek(state.time + passed * state.speed);
      if (state.time >= data.duration) setPlaying(false);
    }
    if (viewer.needs_render) draw();
    requestAnimationFrame(frame);
  }

  // ---- the bar: who stands when, and what else the captions are coloured by
  function paintStrip() {
    const strip = el("strip"), scale = window.devicePixelRatio || 1;
    const width = strip.width = Math.max(1, Math.round(strip.clientWidth * scale));
    const height = strip.height = Math.max(1, Math.round(strip.clientHeight * scale));
    const pen = strip.getContext("2d");
    if (data.curves) {
      drawStances(pen, data.curves.standing, data.legColours, [0, data.duration || 1], width, height);
    }
    data.captions.forEach(([start, , colour], i) => {
      const end = i + 1 < starts.length ? starts[i + 1] : data.duration;
      if (!colour || !(end > start)) return;
      pen.fillStyle = colour;
      pen.fillRect(width * start / data.duration, 0,
        Math.max(1, width * (end - start) / data.duration), height);
    });
  }

  function toCaption(step) {
    const now = captionAt(state.time + 1e-6);
    const back = step < 0 && state.time > starts[now] + 0.05 ? now : now + step;
    seek(starts[Math.min(Math.max(back, 0), starts.length - 1)] || 0);
  }

  function faster(step) {
    const speeds = [...el("speed").options].map((o) => Number(o.value));
    const next = speeds.indexOf(state.speed) + step;
    setSpeed(speeds[Math.min(Math.max(next, 0), speeds.length - 1)]);
  }

  function oneFrame(step) {
    setPlaying(false);
    seek(state.time + step * FRAME * state.speed);
  }

  // Axes of the world and of the robot's body: x red, y green, z blue.
  const axes = [view.world, ...view.follower ? [view.follower] : []].map((frame) => {
    const cross = new THREE.AxesHelper(0.6 * data.followRadius);
    cross.material.depthTest = false;
    cross.visible = false;
    frame.add(cross);
    return cross;
  });
  function toggleAxes() {
    for (const cross of axes) cross.visible = !cross.visible;
    viewer.set_dirty();
  }

  const help = makeHelp();
  const switches = addSwitches(viewer, data.switches, hash, dot);
  const keys = [
    { key: " ", shown: "space", does: "play or pause", act: () => setPlaying(!state.playing) },
    { key: "ArrowLeft", shown: "←", does: "back; with shift to the phase before",
      act: (e) => e.shiftKey ? toCaption(-1) : seek(state.time - state.speed) },
    { key: "ArrowRight", shown: "→", does: "on; with shift to the next phase",
      act: (e) => e.shiftKey ? toCaption(1) : seek(state.time + state.speed) },
    { key: ",", shown: ",", does: "one frame back", act: () => oneFrame(-1) },
    { key: ".", shown: ".", does: "one frame on", act: () => oneFrame(1) },
    { key: "Home", shown: "Home", does: "to the start", act: () => seek(0) },
    { key: "End", shown: "End", does: "to the end", act: () => seek(data.duration) },
    { key: ["-", "_"], shown: "−", does: "slower", act: () => faster(-1) },
    { key: ["+", "="], shown: "+", does: "faster", act: () => faster(1) },
    { key: "f", shown: "F", does: "the camera follows the robot", act: () => setFollow(!state.follow) },
    { key: "r", shown: "R", does: "back to the first view", act: () => setView("first") },
    ...Object.keys(PRESETS).map((name, i) => (
      { key: String(i + 1), shown: String(i + 1), does: `view: ${name}`, act: () => setView(name) })),
    { key: "n", shown: "N", does: "names of the feet",
      act: () => { labels.names = !labels.names; viewer.set_dirty(); } },
    { key: "x", shown: "X", does: "axes of the world and of the body", act: toggleAxes },
    ...curves ? [
      { key: "c", shown: "C", does: "curves", act: () => setCurves(!curves.open) },
      { key: "z", shown: "Z", does: "curves: the whole time, or around now",
        act: () => curves.zoom(state.time) },
    ] : [],
    ...switches,
    { key: "?", shown: "?", does: "this list", act: help.toggle },
    { key: "Escape", shown: "Esc", does: "close it", act: help.close },
  ];
  addKeys(keys);
  el("play").addEventListener("click", () => setPlaying(!state.playing));
  el("follow").addEventListener("click", () => setFollow(!state.follow));
  el("home").addEventListener("click", () => setView("first"));
  el("more").addEventListener("click", () => setCurves(!curves.open));
  el("more").hidden = !curves;
  el("follow").hidden = !view.follower;
  el("view").addEventListener("change", () => setView(el("view").value));
  el("speed").addEventListener("change", () => setSpeed(Number(el("speed").value)));
  el("scrub").addEventListener("input", () => seek(data.duration * el("scrub").value / 1e6));
  document.querySelector("#about h1").addEventListener("click",
    () => { el("about").classList.toggle("folded"); fit(); });
  // After the mouse or a finger a control gives the keys back to the replay.
  for (const id of ["play", "follow", "home", "more", "view", "speed", "scrub"]) {
    if (id !== "view" && id !== "speed") el(id).addEventListener("pointerup", () => el(id).blur());
    el(id).addEventListener("change", () => el(id).blur());
  }
  window.addEventListener("resize", () => {
    paintStrip();
    if (curves) curves.update(state.time);
    fit();
  });

  // ---- start: the address may say where, as in replay.html#t=60&paused&speed=5&follow&curves
  const narrow = window.innerWidth < 640;
  // In a low window, as in the page of a site, the list of colours would cover the robot.
  el("about").classList.toggle("folded", narrow || window.innerHeight < 520);
  viewer.set_3d_pane_size();
  const wanted = Number(hash.get("speed"));
  setSpeed([...el("speed").options].some((o) => Number(o.value) === wanted) ? wanted : data.speed);
  seek(Number(hash.get("t")) || 0);
  if (hash.has("view")) view.from = PRESETS[hash.get("view")] || view.from;
  setCurves(!!curves && (hash.has("curves")
    || !hash.has("no-curves") && window.innerHeight >= 760 && window.innerWidth >= 900));
  // On a telephone, and of long routes, the whole would leave the robot a few millimetres.
  setFollow(false);
  setFollow(hash.has("follow")
    || !hash.has("no-follow") && !hash.has("film") && !data.inView.length && (narrow || view.tiny()));
  if (hash.has("axes")) toggleAxes();
  paintStrip();
  setPlaying(!hash.has("paused"));
  document.body.classList.toggle("film", hash.has("film"));
  window.gaitopt = { duration: data.duration, state, seek, setPlaying, setSpeed, setFollow, setView, setCurves, draw, viewer,
    pass, curves, view };
  requestAnimationFrame(frame);
  requestAnimationFrame(() => { document.body.dataset.ready = "yes"; });
})();
