"use strict";
// Tubes along lines and flat polygons. The page holds their points; triangles are made here.
const SIDES = 6;
// Corners of a border: the least sine of an angle, and the longest corner over the width. They are
// those of solids.py; corners of support polygons below 10 degrees are cut off.
const LEAST_SINE = 0.05, LONGEST_CORNER = 6;

const minus = (p, q) => [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
const plus = (p, q, f) => [p[0] + f * q[0], p[1] + f * q[1], p[2] + f * q[2]];
const cross = (p, q) => [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
const unitOf = (p) => { const n = Math.hypot(...p) || 1; return p.map((x) => x / n); };

// A tube with open ends around a line of points, appended to places and index.
function addTube(points, radius, places, index) {
  const steps = points.slice(1).map((p, i) => unitOf(minus(p, points[i])));
  const tangents = points.map((_, i) => {
    const before = steps[Math.max(i - 1, 0)], after = steps[Math.min(i, steps.length - 1)];
    const sum = plus(before, after, 1);
    return Math.hypot(...sum) < 1e-9 ? before : unitOf(sum);
  });
  // All rings begin in the direction of one axis, to which the tangents are least parallel, so that
  // the tube is not twisted.
  const largest = [0, 1, 2].map((k) => Math.max(...tangents.map((t) => Math.abs(t[k]))));
  const axis = [0, 0, 0];
  axis[largest.indexOf(Math.min(...largest))] = 1;
  const first = places.length / 3;
  points.forEach((point, i) => {
    const second = unitOf(cross(tangents[i], axis)), third = cross(tangents[i], second);
    for (let k = 0; k < SIDES; k++) {
      const angle = 2 * Math.PI * k / SIDES;
      const out = plus(plus(point, second, radius * Math.cos(angle)), third, radius * Math.sin(angle));
      places.push(...out);
    }
  });
  for (let i = 0; i + 1 < points.length; i++) {
    for (let k = 0; k < SIDES; k++) {
      const a = first + i * SIDES + k, b = first + i * SIDES + (k + 1) % SIDES;
      index.push(a, b, a + SIDES, b, b + SIDES, a + SIDES);
    }
  }
}

// The corners of a convex polygon whose sides are moved inward.
function innerCorners(corners, width) {
  const n = corners.length;
  const sides = corners.map((p, i) => unitOf(minus(corners[(i + 1) % n], p)));
  return corners.map((p, i) => {
    const before = sides[(i + n - 1) % n], after = sides[i];
    const sine = Math.abs(cross(before, after)[2]);
    const far = Math.min(width / Math.max(sine, LEAST_SINE), LONGEST_CORNER * width);
    return plus(p, minus(after, before), far);
  });
}

// A convex polygon, or with a width a strip along its border.
function addPolygon(corners, width, places, index) {
  const first = places.length / 3, n = corners.length;
  places.push(...corners.flat());
  if (!width) {
    for (let i = 1; i + 1 < n; i++) index.push(first, first + i, first + i + 1);
    return;
  }
  places.push(...innerCorners(corners, width).flat());
  for (let i = 0; i < n; i++) {
    const a = first + i, b = first + (i + 1) % n;
    index.push(a, b, b + n, a, b + n, a + n);
  }
}

// xyz are the points of all parts.
function solidOf(THREE, part, xyz) {
  const places = [], index = [];
  let first = part.first;
  for (const count of part.counts) {
    const points = [];
    for (let i = first; i < first + count; i++) points.push(xyz.map((column) => column[i]));
    first += count;
    if (part.kind === "tubes") addTube(points, part.radius, places, index);
    else addPolygon(points, part.width, places, index);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
  geometry.setIndex(index);
  const look = { color: part.colour, opacity: part.opacity, side: THREE.DoubleSide,
    transparent: part.opacity < 1, depthWrite: part.opacity === 1 };
  if (part.lit) geometry.computeVertexNormals();
  const mesh = new THREE.Mesh(geometry, part.lit
    ? new THREE.MeshPhongMaterial({ ...look, shininess: 35, specular: 0x2a2a2a })
    : new THREE.MeshBasicMaterial(look));
  mesh.renderOrder = part.layer;
  return mesh;
}
