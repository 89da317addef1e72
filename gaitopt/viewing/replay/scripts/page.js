"use strict";
(() => {
  const el = (id) => document.getElementById(id);
  const read = (id) => JSON.parse(el(id).textContent);
  const data = read("data");
  const THREE = MeshCat.THREE;
  const BACKDROP = 0xecf0f4;
  document.querySelector("#about h1").textContent = document.title;

  let viewer;
  try {
    viewer = new MeshCat.Viewer(el("meshcat-pane"), false);
  } catch (error) {
    el("problem").hidden = false;
    el("problem").textContent = "This replay needs WebGL, which this browser does not offer.";
    return;
  }
  for (const text of read("commands")) {
    viewer.handle_command_bytearray(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)));
  }

  // ---- scene dressing: an endless floor, one sun whose shadow map stays around the view
  const toView = ([x, y, z]) => new THREE.Vector3(x, z, -y);
  const centre = toView(data.centre);
  viewer.scene.background = new THREE.Color(BACKDROP);
  viewer.scene.fog = new THREE.Fog(BACKDROP, 5 * data.radius + 3, 14 * data.radius + 8);
  viewer.renderer.shadowMap.enabled = true;
  for (const name of Object.keys(viewer.scene_tree.children.Lights.children)) {
    viewer.set_property(["Lights", name], "visible", false);
  }
  const widest = 4;
  const reach = Math.min(data.radius * 1.15, widest);
  const ahead = new THREE.Vector3(Math.cos(data.heading), 0, -Math.sin(data.heading));
  const left = new THREE.Vector3(ahead.z, 0, -ahead.x);
  const sunOffset = new THREE.Vector3(0, 4, 0).addScaledVector(ahead, 1.5).addScaledVector(left, -1);
  const sun = new THREE.DirectionalLight(0xffffff, 0.44);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.bias = -0.0006;
  sun.shadow.radius = 4;
  Object.assign(sun.shadow.camera,
    { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.5, far: 12 });
  const fill = new THREE.DirectionalLight(0xf4f7ff, 0.3);
  fill.position.copy(ahead).multiplyScalar(0.6).addScaledVector(left, 1.5);
  // meshcat turns the scene itself; lights and camera are easier to place beside a turned group.
  viewer.scene.rotation.x = 0;
  const world = new THREE.Group();
  world.rotation.x = -Math.PI / 2;
  for (const child of [...viewer.scene.children]) world.add(child);
  const sky = new THREE.HemisphereLight(0xffffff, 0xcdd2da, 0.58);
  viewer.scene.add(world, sun, sun.target, fill, sky);

  // ---- camera
  const camera = viewer.camera, controls = viewer.controls;
  camera.fov = 32;
  camera.near = 0.05;
  camera.far = 400;
  const meshOf = drawGround(THREE, viewer, data.ground);
  const move = makeMotion(THREE, viewer, data.tracks);
  const pass = makePassing(THREE, viewer, data.passing, meshOf);
  controls.maxDistance = 60;
  controls.maxPolarAngle = 0.49 * Math.PI;
  const follower = data.follow
    ? viewer.scene_tree.find(data.follow.split("/").filter(Boolean)).object : null;
  const place = new THREE.Vector3(), before = new THREE.Vector3();
  const whereIsIt = (out) => {
    follower.updateWorldMatrix(true, false);
    return out.setFromMatrixPosition(follower.matrixWorld);
  };

  // How far a camera that looks along -direction at the target must be to see all points.
  function distanceTo(points, direction) {
    const right = new THREE.Vector3(0, 1, 0).cross(direction).normalize();
    const up = new THREE.Vector3().crossVectors(direction, right);
    const tall = Math.tan(camera.fov * Math.PI / 360);
    const wide = tall * window.innerWidth / window.innerHeight;
    return Math.max(...points.map((point) => {
      const away = toView(point).sub(controls.target);
      const side = Math.abs(away.dot(right)) / wide, height = Math.abs(away.dot(up)) / tall;
      return away.dot(direction) + 1.04 * Math.max(side, height / 0.8);
    }));
  }

  // Until somebody takes hold of the camera, the view fits the window.
  let moved = false;
  controls.addEventListener("start", () => { moved = true; });

  function resetView() {
    const narrow = Math.min(1, window.innerWidth / window.innerHeight / 1.6);
    const radius = state.follow ? data.followRadius : data.radius;
    const [forth, aside, above] = data.viewFrom;
    const direction = new THREE.Vector3(0, above, 0)
      .addScaledVector(ahead, forth).addScaledVector(left, aside).normalize();
    controls.target.copy(centre);
    if (state.follow) {
      whereIsIt(place);
      const drop = data.followDrop;
      controls.target.set(place.x, drop === null ? centre.y : place.y - drop, place.z);
    }
    controls.target.y -= 0.08 * radius;
    const distance = data.inView.length && !state.follow ? distanceTo(data.inView, direction)
      : 0.8 * radius / Math.sin(camera.fov * Math.PI / 360) / narrow;
    camera.position.copy(controls.target).addScaledVector(direction, distance);
    before.copy(follower ? whereIsIt(place) : centre);
    moved = false;
    viewer.set_dirty();
  }

  // ---- names above frames
  const labels = data.labels.map((label) => {
    const box = document.createElement("div"), name = document.createElement("b");
    const below = document.createElement("span");
    name.append(dot(label.colour), label.name);
    box.className = label.kind === "runner" ? "label" : `label ${label.kind}`;
    box.append(name, below);
    el("scene").append(box);
    const frame = viewer.scene_tree.find(label.frame.split("/").filter(Boolean)).object;
    return { label, box, below, frame };
  });

  function placeLabels() {
    camera.updateMatrixWorld();
    for (const { label, box, below, frame } of labels) {
      frame.updateWorldMatrix(true, false);
      place.setFromMatrixPosition(frame.matrixWorld);
      place.y += label.lift;
      place.project(camera);
      const x = (place.x + 1) / 2 * window.innerWidth, y = (1 - place.y) / 2 * window.innerHeight;
      box.style.transform = `translate(${x}px, ${y}px) translate(-50%, -100%)`;
      box.style.zIndex = String(Math.round(1e6 * (1 - place.z)));
      const done = state.time >= label.since;
      box.hidden = place.z > 1 || label.kind === "event" && !done;
      if (label.kind !== "runner") continue;
      box.classList.toggle("done", done);
      below.textContent = done ? label.result
        : `${countUpTo(label.landings, state.time)} of ${label.landings.length} steps`;
    }
  }

  // ---- time
  const hash = new URLSearchParams(location.hash.slice(1));
  const state = { time: 0, playing: false, speed: data.speed, follow: false };
  const starts = data.captions.map((m) => m[0]);

  const captionAt = (time) => Math.max(0, countUpTo(starts, time) - 1);

  function clock(seconds) {
    const minutes = Math.floor(seconds / 60), rest = seconds - 60 * minutes;
    return `${minutes}:${rest.toFixed(1).padStart(4, "0")}`;
  }

  function seek(time) {
    state.time = Math.min(Math.max(time, 0), data.duration);
    move(state.time);
    pass(state.time);
    if (follower) {
      whereIsIt(place);
      if (state.follow) {
        camera.position.add(place).sub(before);
        controls.target.add(place).sub(before);
      }
      before.copy(place);
    }
    sun.target.position.copy(reach < widest || !follower ? centre : place);
    sun.position.copy(sun.target.position).add(sunOffset);
    const [, label, , mark] = data.captions[captionAt(state.time)] || [0, "", "", ""];
    el("phase").replaceChildren(...(mark ? [dot(mark)] : []), label);
    el("clock").textContent = `${clock(state.time)} / ${clock(data.duration)}`;
    el("scrub").value = data.duration > 0 ? Math.round(1e6 * state.time / data.duration) : 0;
  }

  function dot(colour) {
    const mark = document.createElement("i");
    mark.style.background = colour;
    return mark;
  }

  function setPlaying(playing) {
    if (playing && state.time >= data.duration) seek(0);
    state.playing = playing && data.duration > 0;
    el("play").classList.toggle("playing", state.playing);
  }

  function setSpeed(speed) {
    state.speed = speed;
    el("speed").value = String(speed);
  }

  function setFollow(follow) {
    state.follow = follow && follower !== null;
    el("follow").setAttribute("aria-pressed", String(state.follow));
    resetView();
  }

  function draw() {
    viewer.render();
    placeLabels();
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

  // ---- controls
  function paintStrip() {
    const strip = el("strip"), scale = window.devicePixelRatio || 1;
    const width = strip.width = Math.max(1, Math.round(strip.clientWidth * scale));
    strip.height = Math.round(6 * scale);
    const pen = strip.getContext("2d");
    data.captions.forEach(([start, , colour], i) => {
      const end = i + 1 < starts.length ? starts[i + 1] : data.duration;
      if (!colour || !(end > start)) return;
      pen.fillStyle = colour;
      pen.fillRect(width * start / data.duration, 0,
        Math.max(1, width * (end - start) / data.duration), strip.height);
    });
  }

  function toCaption(step) {
    const now = captionAt(state.time + 1e-6);
    const back = step < 0 && state.time > starts[now] + 0.05 ? now : now + step;
    seek(starts[Math.min(Math.max(back, 0), starts.length - 1)] || 0);
  }

  const keys = {
    " ": () => setPlaying(!state.playing),
    ArrowLeft: (event) => event.shiftKey ? toCaption(-1) : seek(state.time - state.speed),
    ArrowRight: (event) => event.shiftKey ? toCaption(1) : seek(state.time + state.speed),
    Home: () => seek(0),
    End: () => seek(data.duration),
    f: () => setFollow(!state.follow),
    r: () => resetView(),
  };
  Object.assign(keys, addSwitches(viewer, data.switches, hash, dot));
  window.addEventListener("keydown", (event) => {
    const act = keys[event.key] || keys[event.key.toLowerCase()];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act(event);
  });
  el("play").addEventListener("click", () => setPlaying(!state.playing));
  el("follow").addEventListener("click", () => setFollow(!state.follow));
  el("home").addEventListener("click", resetView);
  el("speed").addEventListener("change", () => setSpeed(Number(el("speed").value)));
  el("scrub").addEventListener("input", () => seek(data.duration * el("scrub").value / 1e6));
  // Keys belong to the replay, wherever the mouse has been last.
  for (const id of ["play", "follow", "home", "speed", "scrub"]) {
    el(id).addEventListener("pointerup", () => el(id).blur());
    el(id).addEventListener("change", () => el(id).blur());
  }
  window.addEventListener("resize", () => {
    paintStrip();
    if (moved) viewer.set_dirty(); else resetView();
  });

  // ---- start: the address may say where, as in replay.html#t=60&paused&speed=5&follow
  viewer.set_3d_pane_size();
  const wanted = Number(hash.get("speed"));
  setSpeed([...el("speed").options].some((o) => Number(o.value) === wanted) ? wanted : data.speed);
  seek(Number(hash.get("t")) || 0);
  setFollow(hash.has("follow"));
  paintStrip();
  setPlaying(!hash.has("paused"));
  window.gaitopt = { state, seek, setPlaying, setSpeed, setFollow, draw, viewer, pass };
  requestAnimationFrame(frame);
  requestAnimationFrame(() => { document.body.dataset.ready = "yes"; });
})();
