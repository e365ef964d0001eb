// A camera for the plain canvas, and the vehicle as a handful of faces. World frame: x east, y north, z up, in m.

/** Pseudo-random number in [0, 1) that depends on its arguments alone. */
function hash(i, j, k = 0) {
  let n = Math.imul(i | 0, 374761393) ^ Math.imul(j | 0, 668265263) ^ Math.imul(k | 0, 2147483647 ^ 0x5bd1e995);
  n = Math.imul(n ^ (n >>> 13), 1274126177);
  return ((n ^ (n >>> 16)) >>> 0) / 4294967296;
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** A camera that looks at a target. */
class Camera {
  constructor(azimuth, pitch, distance, target, width, height) {
    const [ca, sa, cp, sp] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(pitch), Math.sin(pitch)];
    this.forward = [cp * ca, cp * sa, -sp];
    this.right = [sa, -ca, 0];
    this.up = [ca * sp, sa * sp, cp];
    this.eye = target.map((value, axis) => value - distance * this.forward[axis]);
    this.focus = Math.min(width * 0.95, height * 1.25);
    [this.width, this.height, this.middle] = [width, height, height * 0.47];
    this.horizon = cp < 0.02 ? -1e9 : this.middle - this.focus * (sp / cp);
  }

  /** Screen x and y, and depth; null for what is behind the camera. */
  project(x, y, z) {
    const offset = [x - this.eye[0], y - this.eye[1], z - this.eye[2]];
    const depth = dot(offset, this.forward);
    if (depth < 0.25) return null;
    const scale = this.focus / depth;
    return [
      this.width / 2 + scale * dot(offset, this.right),
      this.middle - scale * dot(offset, this.up),
      depth,
      scale,
    ];
  }
}

const VEHICLE_SCALE = 1.5; // so that it can be seen from some metres away

/** Faces of a box: corners counter-clockwise from outside, and the outward normal. */
function boxFaces([x0, x1], [y0, y1], [z0, z1], tint) {
  const corner = (x, y, z) => [x ? x1 : x0, y ? y1 : y0, z ? z1 : z0];
  return [
    [[0, 0, 1], [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]],
    [[0, 0, -1], [[0, 1, 0], [1, 1, 0], [1, 0, 0], [0, 0, 0]]],
    [[1, 0, 0], [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]]],
    [[-1, 0, 0], [[0, 1, 0], [0, 0, 0], [0, 0, 1], [0, 1, 1]]],
    [[0, 1, 0], [[1, 1, 0], [0, 1, 0], [0, 1, 1], [1, 1, 1]]],
    [[0, -1, 0], [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]]],
  ].map(([normal, corners]) => ({ normal, tint, points: corners.map(([x, y, z]) => corner(x, y, z)) }));
}

const HULL = [
  ...boxFaces([-0.21, 0.2], [0.02, 0.165], [0.055, 0.125], [46, 134, 222]),
  ...boxFaces([-0.21, 0.2], [-0.165, -0.02], [0.055, 0.125], [46, 134, 222]),
  ...boxFaces([-0.2, 0.2], [0.15, 0.168], [-0.125, 0.055], [38, 48, 54]),
  ...boxFaces([-0.2, 0.2], [-0.168, -0.15], [-0.125, 0.055], [38, 48, 54]),
  ...boxFaces([-0.17, 0.19], [-0.055, 0.055], [-0.02, 0.085], [226, 232, 236]),
  ...boxFaces([0.19, 0.225], [-0.045, 0.045], [-0.005, 0.075], [120, 220, 255]),
  ...boxFaces([-0.15, 0.13], [-0.045, 0.045], [-0.12, -0.045], [196, 204, 210]),
  ...boxFaces([-0.2, 0.2], [-0.16, 0.16], [-0.135, -0.12], [30, 38, 44]),
];

/** Thrusters in their numbers' order: where they are, and along which axis they push. */
const H = Math.SQRT1_2;
const THRUSTER_PLACES = [
  [[0.15, -0.155, -0.03], [H, H, 0]], [[0.15, 0.155, -0.03], [H, -H, 0]],
  [[-0.16, -0.155, -0.03], [H, -H, 0]], [[-0.16, 0.155, -0.03], [H, H, 0]],
  [[0, -0.13, 0.128], [0, 0, 1]], [[0, 0.13, 0.128], [0, 0, 1]],
];

/** Turns body coordinates into the world's, for a pose. */
function bodyToWorld(pose, scale) {
  const [cy, sy] = [Math.cos(pose.yaw), Math.sin(pose.yaw)];
  const [cp, sp] = [Math.cos(pose.pitch), Math.sin(pose.pitch)];
  const [cr, sr] = [Math.cos(pose.roll), Math.sin(pose.roll)];
  const rows = [
    [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
    [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
    [-sp, cp * sr, cp * cr],
  ];
  const turn = (v) => rows.map((row) => dot(row, v));
  const place = (v) => {
    const [x, y, z] = turn(v);
    return [pose.x + scale * x, pose.y + scale * y, pose.z + scale * z];
  };
  return { turn, place };
}

const LIGHT = [-0.28, 0.22, 0.93];
const shade = (tint, normal, light = 1) => {
  const lit = 0.42 + 0.58 * Math.max(0, dot(normal, LIGHT));
  return `rgb(${tint.map((value) => Math.round(Math.min(255, value * lit * light))).join(',')})`;
};
