"use strict";
// Height maps, and what lies upon them. The page holds heights as numbers of 16 bits; triangles are
// made here. Each cell is divided by the diagonal from (i, j) to (i + 1, j + 1), as the plan is.
const drawGround = (() => {
  const UNKNOWN = 65535;
  const LOW = [0.66, 0.72, 0.76], HIGH = [0.96, 0.93, 0.86];
  const WALL = 0.05, LIFT = 0.0006, GRID = 0.1, INK = 0x46525e;

  function heightsOf({ shape: [nx, ny], step, origin: [x0, y0], low, unit, z: text }) {
    const bytes = bytesOf(text), z = new Float32Array(nx * ny);
    let bottom = Infinity, top = -Infinity;
    for (let k = 0; k < z.length; k++) {
      const number = bytes[2 * k] | bytes[2 * k + 1] << 8;
      z[k] = number === UNKNOWN ? NaN : low + unit * number;
      if (z[k] < bottom) bottom = z[k];
      if (z[k] > top) top = z[k];
    }
    return { nx, ny, step, x0, y0, z, bottom, top };
  }

  // Both triangles of a cell, as points of the map; those without unknown heights.
  function trianglesOf(map, i, j) {
    const a = i * map.ny + j, b = a + map.ny, c = b + 1, d = a + 1;
    return [[a, b, c], [a, c, d]].filter((t) => t.every((k) => !Number.isNaN(map.z[k])));
  }

  function pointOf(map, k) {
    const i = Math.floor(k / map.ny), j = k - i * map.ny;
    return [map.x0 + i * map.step, map.y0 + j * map.step, map.z[k]];
  }

  function shadeOf(map, z) {
    const part = map.top - map.bottom > 1e-3 ? (z - map.bottom) / (map.top - map.bottom) : 0.5;
    return LOW.map((low, i) => low + part * (HIGH[i] - low));
  }

  // Walls below the border of the map, so that it looks solid.
  function addWalls(map, places, colours, index) {
    const { nx, ny } = map, base = map.bottom - WALL, rim = [];
    for (let i = 0; i < nx; i++) rim.push(i * ny);
    for (let j = 1; j < ny; j++) rim.push((nx - 1) * ny + j);
    for (let i = nx - 2; i >= 0; i--) rim.push(i * ny + ny - 1);
    for (let j = ny - 2; j >= 0; j--) rim.push(j);
    for (let n = 0; n + 1 < rim.length; n++) {
      const [p, q] = [pointOf(map, rim[n]), pointOf(map, rim[n + 1])];
      if (Number.isNaN(p[2]) || Number.isNaN(q[2])) continue;
      const first = places.length / 3;
      places.push(...p, ...q, q[0], q[1], base, p[0], p[1], base);
      for (const z of [p[2], q[2], base, base]) colours.push(...shadeOf(map, Math.max(z, map.bottom)));
      index.push(first, first + 3, first + 1, first + 1, first + 3, first + 2);
    }
  }

  function surfaceOf(THREE, map, walls) {
    const { nx, ny } = map, places = [], colours = [], index = [], uv = [];
    for (let k = 0; k < nx * ny; k++) {
      const [x, y, z] = pointOf(map, k);
      places.push(x, y, Number.isNaN(z) ? map.bottom : z);
      colours.push(...shadeOf(map, Number.isNaN(z) ? map.bottom : z));
      uv.push((Math.floor(k / ny) + 0.5) / nx, (k % ny + 0.5) / ny);
    }
    for (let i = 0; i + 1 < nx; i++) {
      for (let j = 0; j + 1 < ny; j++) for (const t of trianglesOf(map, i, j)) index.push(...t);
    }
    if (walls) addWalls(map, places, colours, index);
    const out = new THREE.BufferGeometry();
    out.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
    if (walls) out.setAttribute("color", new THREE.Float32BufferAttribute(colours, 3));
    else out.setAttribute("uv", new THREE.Float32BufferAttribute(uv, 2));
    out.setIndex(index);
    out.computeVertexNormals();
    return out;
  }

  // Lines along the rows of points about every 0.1 m; few enough on large maps.
  function gridOf(THREE, map) {
    const { nx, ny } = map, places = [];
    let every = Math.max(1, Math.round(GRID / map.step));
    while (Math.max(nx, ny) / every > 100) every *= 2;
    const add = (a, b) => {
      if (!Number.isNaN(map.z[a] + map.z[b])) places.push(...pointOf(map, a), ...pointOf(map, b));
    };
    for (let i = 0; i < nx; i++) {
      for (let j = 0; j < ny; j++) {
        const k = i * ny + j;
        if (i % every === 0 && j + 1 < ny) add(k, k + 1);
        if (j % every === 0 && i + 1 < nx) add(k, k + ny);
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial(
      { color: INK, opacity: 0.16, transparent: true, depthWrite: false }));
  }

  function reliefOf(THREE, map, { codes, palette, opacity, layer }) {
    const look = { flatShading: true, shininess: 0, specular: 0, side: THREE.DoubleSide };
    if (!codes) {
      const mesh = new THREE.Mesh(surfaceOf(THREE, map, true),
        new THREE.MeshPhongMaterial({ ...look, vertexColors: true, ...upon(-1) }));
      mesh.castShadow = mesh.receiveShadow = true;
      mesh.add(gridOf(THREE, map));
      return mesh;
    }
    const of = bytesOf(codes), pixels = new Uint8Array(4 * of.length);
    const shades = palette.map((text) => parseInt(text.slice(1), 16));
    for (let k = 0; k < of.length; k++) {
      const shade = shades[of[k]], at = 4 * ((k % map.ny) * map.nx + Math.floor(k / map.ny));
      pixels.set([shade >> 16, shade >> 8 & 255, shade & 255, 255], at);
    }
    const texture = new THREE.DataTexture(pixels, map.nx, map.ny, THREE.RGBAFormat);
    texture.needsUpdate = true;
    const mesh = new THREE.Mesh(surfaceOf(THREE, map, false), new THREE.MeshPhongMaterial(
      { ...look, map: texture, opacity, transparent: true, depthWrite: false, ...upon(layer) }));
    mesh.receiveShadow = true;
    mesh.renderOrder = layer;
    return mesh;
  }

  // What lies upon a surface is drawn as if a little nearer, or both would flicker.
  const upon = (layer) => (
    { polygonOffset: true, polygonOffsetFactor: -layer, polygonOffsetUnits: -4 * layer });

  // The part of a polygon [[x, y, z], ...] on the left of the line through p and q.
  function cut(polygon, [px, py], [qx, qy]) {
    const side = ([x, y]) => (qx - px) * (y - py) - (qy - py) * (x - px), out = [];
    polygon.forEach((a, n) => {
      const b = polygon[(n + 1) % polygon.length], sa = side(a), sb = side(b);
      if (sa >= 0) out.push(a);
      if (sa >= 0 !== sb >= 0) out.push(a.map((value, i) => value + sa / (sa - sb) * (b[i] - value)));
    });
    return out;
  }

  // Triangles of the surface below a convex polygon [[x, y], ...], cut off at its sides.
  function addDraped(map, corners, places) {
    let area = 0;
    corners.forEach(([x, y], n) => {
      const [u, v] = corners[(n + 1) % corners.length];
      area += x * v - u * y;
    });
    const ring = area < 0 ? [...corners].reverse() : corners;
    const range = (axis, from, count) => {
      const cells = ring.map((corner) => (corner[axis] - from) / map.step);
      return [Math.max(Math.floor(Math.min(...cells)), 0),
        Math.min(Math.ceil(Math.max(...cells)), count - 1)];
    };
    const [i0, i1] = range(0, map.x0, map.nx), [j0, j1] = range(1, map.y0, map.ny);
    for (let i = i0; i < i1; i++) {
      for (let j = j0; j < j1; j++) {
        for (const triangle of trianglesOf(map, i, j)) {
          let part = triangle.map((k) => pointOf(map, k));
          for (let n = 0; n < ring.length && part.length > 2; n++) {
            part = cut(part, ring[n], ring[(n + 1) % ring.length]);
          }
          for (let n = 1; n + 1 < part.length; n++) {
            for (const [x, y, z] of [part[0], part[n], part[n + 1]]) places.push(x, y, z + LIFT);
          }
        }
      }
    }
  }

  function drapedOf(THREE, map, { polygons, colour, opacity, layer }) {
    const places = [];
    for (const corners of polygons) addDraped(map, corners, places);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
    const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: colour, opacity,
      transparent: true, depthWrite: false, side: THREE.DoubleSide, ...upon(layer) }));
    mesh.renderOrder = layer;
    return mesh;
  }

  // three.js takes sizes of dots as for a field of view of 90 degrees.
  function dotsOf(THREE, fov, { points, size: wide, colour }) {
    const size = wide / Math.tan(fov * Math.PI / 360);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position",
      new THREE.BufferAttribute(new Float32Array(bytesOf(points).buffer), 3));
    return new THREE.Points(geometry, new THREE.PointsMaterial({ size, color: colour }));
  }

  // Adds what the page holds, and returns a function that makes the mesh of a part.
  return (THREE, viewer, ground) => {
    const maps = ground.heights.map(heightsOf), xyz = columnsOf(ground.points);
    const kinds = {
      relief: (part) => reliefOf(THREE, maps[part.heights], part),
      draped: (part) => drapedOf(THREE, maps[part.heights], part),
      dots: (part) => dotsOf(THREE, viewer.camera.fov, part),
      tubes: (part) => solidOf(THREE, part, xyz),
      polygon: (part) => solidOf(THREE, part, xyz),
    };
    const meshOf = (part) => kinds[part.kind](part);
    for (const list of [ground.reliefs, ground.draped, ground.dots, ground.solids]) {
      for (const part of list) viewer.scene_tree.find(part.frame).object.add(meshOf(part));
    }
    return meshOf;
  };
})();
