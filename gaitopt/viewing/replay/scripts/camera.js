"use strict";
// Where the camera stands: a first view that fits the window, presets, and following the robot.
// Directions of presets are along the heading, to its left, and up.
const PRESETS = { back: [-1, 0, 0.35], side: [0, 1, 0.18], front: [1, 0, 0.3], top: [-0.001, 0, 1] };

function makeCamera(THREE, viewer, data) {
  const camera = viewer.camera, controls = viewer.controls;
  const toView = ([x, y, z]) => new THREE.Vector3(x, z, -y);
  const ahead = new THREE.Vector3(Math.cos(data.heading), 0, -Math.sin(data.heading));
  const left = new THREE.Vector3(ahead.z, 0, -ahead.x);
  const centre = toView(data.centre);
  const place = new THREE.Vector3(), before = new THREE.Vector3();
  const follower = data.follow
    ? viewer.scene_tree.find(data.follow.split("/").filter(Boolean)).object : null;
  const view = { follow: false, from: data.viewFrom, moved: false, ahead, left, centre, follower };
  camera.fov = 32;
  camera.near = 0.05;
  camera.far = 400;
  controls.maxDistance = 60;
  controls.maxPolarAngle = 0.49 * Math.PI;
  // Until somebody takes hold of the camera, the view fits the window.
  controls.addEventListener("start", () => { view.moved = true; });

  view.whereIsIt = (out) => {
    follower.updateWorldMatrix(true, false);
    return out.setFromMatrixPosition(follower.matrixWorld);
  };

  // How far a camera that looks along -direction at the target must be to see all points.
  function distanceTo(points, direction) {
    const right = new THREE.Vector3(0, 1, 0).cross(direction).normalize();
    const up = new THREE.Vector3().crossVectors(direction, right);
    const tall = Math.tan(camera.fov * Math.PI / 360);
    const wide = tall * viewer.dom_element.clientWidth / viewer.dom_element.clientHeight;
    return Math.max(...points.map((point) => {
      const away = toView(point).sub(controls.target);
      const side = Math.abs(away.dot(right)) / wide, height = Math.abs(away.dot(up)) / tall;
      return away.dot(direction) + 1.04 * Math.max(side, height / 0.8);
    }));
  }

  // How far to be from a ball, of which most fits the window; robots are slimmer than their balls.
  function distanceOf(radius) {
    const tall = Math.tan(camera.fov * Math.PI / 360);
    const wide = tall * viewer.dom_element.clientWidth / viewer.dom_element.clientHeight;
    const across = view.follow ? 0.84 : 0.8, upward = view.follow ? 0.95 : 0.8;
    return Math.max(upward * radius / Math.sin(camera.fov * Math.PI / 360),
      across * radius / Math.sin(Math.atan(wide)));
  }

  // Whether the robot is drawn less than some hundred pixels wide.
  view.tiny = () => {
    if (!follower) return false;
    const high = 2 * camera.position.distanceTo(controls.target) * Math.tan(camera.fov * Math.PI / 360);
    return 1.4 * data.followRadius / high * viewer.dom_element.clientHeight < 100;
  };

  view.reset = () => {
    const radius = view.follow ? data.followRadius : data.radius;
    const [forth, aside, above] = view.from;
    const direction = new THREE.Vector3(0, above, 0)
      .addScaledVector(ahead, forth).addScaledVector(left, aside).normalize();
    controls.target.copy(centre);
    if (view.follow) {
      view.whereIsIt(place);
      const drop = data.followDrop;
      controls.target.set(place.x, drop === null ? centre.y : place.y - drop, place.z);
    }
    controls.target.y -= 0.08 * radius;
    const distance = data.inView.length && !view.follow ? distanceTo(data.inView, direction)
      : distanceOf(radius);
    camera.position.copy(controls.target).addScaledVector(direction, distance);
    before.copy(follower ? view.whereIsIt(place) : centre);
    view.moved = false;
    viewer.set_dirty();
  };

  // Moves with the robot; returns where that is.
  view.track = () => {
    if (!follower) return centre;
    view.whereIsIt(place);
    if (view.follow) {
      camera.position.add(place).sub(before);
      controls.target.add(place).sub(before);
    }
    return before.copy(place);
  };
  return view;
}

// Without a graphics card the processor draws: then a replay that plays has half as many pixels each
// way, and one that pauses has all of them. Videos always have all.
function makeSharpness(viewer, hash) {
  const gl = viewer.renderer.getContext(), names = gl.getExtension("WEBGL_debug_renderer_info");
  const name = names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  const slow = /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name) && !hash.has("film");
  const all = viewer.renderer.getPixelRatio();
  return (sharp) => {
    if (!slow) return;
    viewer.renderer.setPixelRatio(sharp ? all : all / 2);
    viewer.set_dirty();
  };
}

// An endless floor, and one sun whose shadow map stays around what is looked at.
function makeLight(THREE, viewer, data, view, backdrop, shadows) {
  const widest = 4, reach = Math.min(data.radius * 1.15, widest);
  viewer.scene.background = new THREE.Color(backdrop);
  viewer.scene.fog = new THREE.Fog(backdrop, 5 * data.radius + 3, 14 * data.radius + 8);
  viewer.renderer.shadowMap.enabled = shadows;
  for (const name of Object.keys(viewer.scene_tree.children.Lights.children)) {
    viewer.set_property(["Lights", name], "visible", false);
  }
  const offset = new THREE.Vector3(0, 4, 0)
    .addScaledVector(view.ahead, 1.5).addScaledVector(view.left, -1);
  const sun = new THREE.DirectionalLight(0xffffff, 0.44);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.bias = -0.0006;
  sun.shadow.radius = 4;
  Object.assign(sun.shadow.camera,
    { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.5, far: 12 });
  const fill = new THREE.DirectionalLight(0xf4f7ff, 0.3);
  fill.position.copy(view.ahead).multiplyScalar(0.6).addScaledVector(view.left, 1.5);
  // meshcat turns the scene itself; lights and camera are easier to place beside a turned group.
  viewer.scene.rotation.x = 0;
  const world = new THREE.Group();
  world.rotation.x = -Math.PI / 2;
  for (const child of [...viewer.scene.children]) world.add(child);
  const sky = new THREE.HemisphereLight(0xffffff, 0xcdd2da, 0.58);
  view.world = world;
  viewer.scene.add(world, sun, sun.target, fill, sky);
  return (place) => {
    sun.target.position.copy(reach < widest || !view.follower ? view.centre : place);
    sun.position.copy(sun.target.position).add(offset);
  };
}
