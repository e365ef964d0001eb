// The picture of one mission at one time: sea bed, pipeline, way, camera's footprint, vehicle and water.

const { pipeline: PIPELINE, sea_bed_z_m: BED, view_tangent: TANGENT, station: STATION } = DATA.scenario;

/** Colours under water, the same in light and dark; in grey they differ by their lightness. */
const SEA_MODES = {
  fd_spiral_low: '#a68cff', fd_spiral_medium: '#63bdff', fd_spiral_high: '#d8fff3', fd_follow_pipeline: '#ffcb5c',
  fd_unground: '#3c5560', '': '#3c5560', fd_generate_recharge_path: '#ff8fd0', __DEFAULT__: '#ff8fd0',
};
const SPARE_SEA_MODES = ['#ff8fd0', '#d7f06b', '#ff9e7a', '#f4e2a0'];
function seaColour(mode) {
  if (!(mode in SEA_MODES)) SEA_MODES[mode] = SPARE_SEA_MODES[Object.keys(SEA_MODES).length % SPARE_SEA_MODES.length];
  return SEA_MODES[mode];
}

const rgb = (tint, alpha = 1) => `rgba(${tint.map(Math.round).join(',')},${alpha})`;
const mixed = (a, b, share) => a.map((value, index) => mix(value, b[index], share));
const CLEAR = { far: [14, 92, 120], deep: [4, 38, 56], bed: [64, 142, 142], top: [58, 170, 196] };
const MURKY = { far: [84, 116, 96], deep: [30, 52, 46], bed: [112, 134, 104], top: [122, 156, 126] };

/** The pipeline in short pieces, so that each has its own depth; with its length so far. */
const PIECES = [];
for (let i = 1, length = 0; i < PIPELINE.length; i++) {
  const [a, b] = [PIPELINE[i - 1], PIPELINE[i]];
  const whole = Math.hypot(b[0] - a[0], b[1] - a[1]);
  const count = Math.max(1, Math.round(whole / 0.5));
  for (let n = 0; n < count; n++) {
    const at = (share) => a.map((value, axis) => mix(value, b[axis], share));
    PIECES.push({ from: at(n / count), to: at((n + 1) / count), start: length + (whole * n) / count });
  }
  length += whole;
}
const PIPE_RADIUS = 0.14;

function tracePath(d, ...points) {
  d.beginPath();
  for (const [x, y] of points) d.lineTo(x, y);
}

function strokeLine(d, from, to) {
  tracePath(d, from, to);
  d.stroke();
}

function fillEllipse(d, style, ...shape) {
  d.fillStyle = style;
  d.beginPath();
  d.ellipse(...shape, 0, 7);
  d.fill();
}

/** A gradient with some colours, each at a share of its length. */
function withStops(gradient, ...stops) {
  for (const [share, style] of stops) gradient.addColorStop(share, style);
  return gradient;
}

/** Light around a point of the screen, of a colour that fades out to the other one. */
function drawGlow(d, [x, y], size, inner, outer) {
  d.fillStyle = withStops(d.createRadialGradient(x, y, 0, x, y, size), [0, inner], [1, outer]);
  d.fillRect(x - size, y - size, 2 * size, 2 * size);
}

function drawScene(surface, play, moment, view) {
  const { drawing: d, width, height } = surface;
  const { clarity } = moment;
  const water = Object.fromEntries(Object.keys(CLEAR).map((key) => [key, mixed(MURKY[key], CLEAR[key], clarity)]));
  const reach = 7 + 17 * clarity; // how far the spectator sees, in m
  const camera = new Camera(view.azimuth, view.pitch, view.distance, view.target, width, height);
  const fog = (depth) => Math.exp(-Math.pow(Math.max(0, depth - view.distance * 0.72) / reach, 1.25));
  const c = { d, camera, width, height, water, fog, clarity, reach, view, moment, play };
  drawWater(c);
  drawBed(c);
  drawSwath(c);
  if (STATION) drawStation(c);
  drawPipeline(c);
  drawWay(c);
  drawShadow(c);
  drawFootprint(c);
  drawVehicle(c);
  drawSnow(c);
  drawMurk(c);
}

function drawWater({ d, camera, width, height, water, moment }) {
  const horizon = clamp(camera.horizon, -0.2 * height, height);
  d.fillStyle = withStops(d.createLinearGradient(0, 0, 0, Math.max(1, horizon)), [0, rgb(water.top)], [1, rgb(water.far)]);
  d.fillRect(0, 0, width, height);
  d.fillStyle = withStops(
    d.createLinearGradient(0, Math.max(horizon, 0), 0, height),
    [0, rgb(horizon > 0 ? water.far : mixed(water.far, water.bed, 0.7))],
    [0.55, rgb(mixed(water.far, water.bed, 0.8))],
    [1, rgb(mixed(water.deep, water.bed, 0.62))],
  );
  d.fillRect(0, Math.max(0, horizon), width, height);
  if (horizon <= 0) return;
  d.globalCompositeOperation = 'screen'; // shafts of light from the surface
  for (let n = 0; n < 6; n++) {
    const x = width * (0.06 + 0.17 * n + 0.02 * Math.sin(moment.t * 0.21 + n * 2.1));
    const broad = width * (0.03 + 0.03 * hash(n, 3));
    const brightest = rgb([150, 230, 235], 0.13 + 0.05 * Math.sin(moment.t * 0.4 + n));
    d.fillStyle = withStops(d.createLinearGradient(0, 0, 0, height * 0.8), [0, brightest], [1, rgb([150, 230, 235], 0)]);
    tracePath(d, [x, 0], [x + broad, 0], [x + broad * 2.6 + width * 0.1, height * 0.8], [x + width * 0.06, height * 0.8]);
    d.fill();
  }
  d.globalCompositeOperation = 'source-over';
}

/** Ripples and stones on the sea bed, the same wherever one looks from. */
function drawBed({ d, camera, water, fog, reach, view, moment }) {
  const radius = Math.ceil(Math.min(18, reach + 4));
  const [cx, cy] = [Math.round(view.target[0]), Math.round(view.target[1])];
  d.lineCap = 'round';
  for (let i = cx - radius; i <= cx + radius; i++) {
    for (let j = cy - radius; j <= cy + radius; j++) {
      const [x, y] = [i + hash(i, j, 1) - 0.5, j + hash(i, j, 2) - 0.5];
      const at = camera.project(x, y, BED);
      if (!at || at[0] < -60 || at[0] > camera.width + 60 || at[1] > camera.height + 60) continue;
      const alpha = fog(at[2]);
      if (alpha < 0.05) continue;
      const turn = 0.5 + 0.35 * Math.sin(x * 0.35 + y * 0.2);
      const half = 0.25 + 0.3 * hash(i, j, 3);
      const [a, b] = [
        camera.project(x - half * Math.sin(turn), y + half * Math.cos(turn), BED),
        camera.project(x + half * Math.sin(turn), y - half * Math.cos(turn), BED),
      ];
      if (!a || !b) continue;
      d.lineWidth = clamp(at[3] * 0.035, 0.5, 5);
      d.strokeStyle = rgb(mixed(water.bed, [210, 240, 225], 0.5), 0.2 * alpha);
      d.beginPath();
      d.moveTo(a[0], a[1]);
      d.quadraticCurveTo(at[0], at[1] - at[3] * 0.05, b[0], b[1]);
      d.stroke();
      if (hash(i, j, 4) > 0.86) {
        const size = at[3] * (0.03 + 0.06 * hash(i, j, 5));
        fillEllipse(d, rgb(mixed(water.deep, water.bed, 0.45), 0.75 * alpha), at[0], at[1], size, size * 0.62, 0);
        const light = rgb(mixed(water.bed, [230, 245, 235], 0.4), 0.45 * alpha);
        fillEllipse(d, light, at[0] - size * 0.15, at[1] - size * 0.22, size * 0.6, size * 0.3, 0);
      }
      const glint = Math.sin(moment.t * 0.9 + 6.3 * hash(i, j, 6));
      if (glint > 0.55) {
        fillEllipse(d, rgb([214, 250, 240], 0.09 * alpha * (glint - 0.55)), at[0], at[1], at[3] * 0.42, at[3] * 0.2, turn);
      }
    }
  }
}

function polygon(d, camera, points) {
  const at = points.map((point) => camera.project(...point));
  if (at.some((each) => !each)) return false;
  d.moveTo(at[0][0], at[0][1]);
  for (const each of at.slice(1)) d.lineTo(each[0], each[1]);
  d.closePath();
  return true;
}

const square = (x, y, half, z = BED) => [
  [x - half, y - half, z], [x + half, y - half, z], [x + half, y + half, z], [x - half, y + half, z],
];

/** What the camera has seen of the sea bed so far, as one shape. */
function drawSwath({ d, camera, play, moment, view, reach }) {
  d.fillStyle = 'rgba(190,246,255,0.11)';
  d.beginPath();
  for (const { x, y, half, t } of play.swath) {
    if (t > moment.t) break;
    if (Math.hypot(x - view.target[0], y - view.target[1]) < reach + 6) polygon(d, camera, square(x, y, half));
  }
  d.fill('nonzero');
}

function drawStation({ d, camera, fog }) {
  const [x, y, radius] = STATION;
  const at = camera.project(x, y, BED);
  if (!at) return;
  d.strokeStyle = `rgba(255,143,208,${0.9 * fog(at[2])})`;
  d.lineWidth = clamp(at[3] * 0.05, 1, 4);
  d.beginPath();
  polygon(d, camera, square(x, y, radius));
  d.stroke();
}

function drawPipeline({ d, camera, fog, moment, water }) {
  d.lineCap = 'round';
  const pieces = [];
  for (const piece of PIECES) {
    const [a, b] = [piece.from, piece.to].map(([x, y, z]) => camera.project(x, y, z + PIPE_RADIUS));
    if (a && b) pieces.push({ piece, a, b, depth: (a[2] + b[2]) / 2 });
  }
  pieces.sort((one, other) => other.depth - one.depth);
  for (const pass of [0, 1]) {
    d.lineCap = pass ? 'butt' : 'round';
    for (const { piece, a, b, depth } of pieces) {
      const alpha = fog(depth);
      if (alpha < 0.03) continue;
      const broad = Math.max(1.2, (camera.focus / depth) * PIPE_RADIUS * 2);
      const line = (dx, dy, wide, style) => {
        d.lineWidth = wide;
        d.strokeStyle = style;
        strokeLine(d, [a[0] + dx - 0.03 * (b[0] - a[0]), a[1] + dy - 0.03 * (b[1] - a[1])], [b[0] + dx, b[1] + dy]);
      };
      if (pass === 0) {
        line(broad * 0.25, broad * 0.42, broad * 1.15, rgb(water.deep, 0.4 * alpha));
        continue;
      }
      const seen = isInspected(piece, moment);
      const base = seen ? [255, 178, 46] : [132, 146, 148];
      const tint = (share, towards) => rgb(mixed(water.far, mixed(base, towards, share), alpha));
      line(0, 0, broad, tint(0.45, [12, 30, 38]));
      line(0, -broad * 0.08, broad * 0.72, tint(0.05, [0, 0, 0]));
      line(0, -broad * 0.22, broad * 0.26, tint(0.55, [255, 255, 255]));
    }
  }
}

/** Whether the vehicle has passed a piece of the pipeline; it goes on from the point seen first, and comes back. */
const isInspected = (piece, moment) => piece.start >= moment.inspectedFrom && piece.start <= moment.inspectedTo;

function drawWay({ d, camera, fog, play, moment }) {
  const { track } = play;
  d.lineCap = 'round';
  d.lineJoin = 'round';
  let last = null;
  for (let i = 0; i <= moment.index + 3; i += 3) {
    const isEnd = i > moment.index;
    const [x, y, z] = isEnd ? [moment.pose.x, moment.pose.y, moment.pose.z] : [track.x_m[i], track.y_m[i], track.z_m[i]];
    const at = camera.project(x, y, z);
    if (at && last) {
      const age = moment.t - track.t_s[Math.min(i, moment.index)];
      const alpha = fog(at[2]) * (0.3 + 0.7 * Math.exp(-age / 45));
      if (alpha > 0.04) {
        d.globalAlpha = alpha;
        d.strokeStyle = seaColour(track.mode[Math.min(i, moment.index)]);
        d.lineWidth = clamp(at[3] * 0.045, 1.1, 5.5);
        strokeLine(d, last, at);
      }
    }
    if (at && !isEnd && i % 30 === 0) { // stems to the sea bed, so that the height can be seen
      const foot = camera.project(x, y, BED);
      const alpha = fog(at[2]) * 0.28;
      if (foot && alpha > 0.03) {
        d.globalAlpha = alpha;
        d.strokeStyle = '#d6f6ff';
        d.lineWidth = 0.8;
        strokeLine(d, at, foot);
      }
    }
    last = at;
    if (isEnd) break;
  }
  d.globalAlpha = 1;
}

function drawShadow({ d, camera, moment }) {
  const { pose, altitude } = moment;
  const at = camera.project(pose.x, pose.y, BED);
  if (!at) return;
  const size = at[3] * 0.3 * VEHICLE_SCALE;
  const darkest = `rgba(0,16,22,${clamp(0.62 - 0.13 * altitude, 0.15, 0.6)})`;
  const dark = withStops(d.createRadialGradient(at[0], at[1], 0, at[0], at[1], size), [0, darkest], [1, 'rgba(0,16,22,0)']);
  fillEllipse(d, dark, at[0], at[1], size, size * clamp(-camera.forward[2] + 0.15, 0.25, 1), 0);
}

/** The camera's view: a pyramid down to the sea bed, or as far as the water lets it see. */
function drawFootprint({ d, camera, moment }) {
  const { pose, altitude, visibility, sees } = moment;
  const depth = sees || visibility === null ? altitude : Math.max(0.2, visibility);
  const eye = [pose.x, pose.y, pose.z - 0.12];
  const base = square(pose.x, pose.y, depth * TANGENT, pose.z - depth);
  const top = camera.project(...eye);
  const middle = camera.project(pose.x, pose.y, pose.z - depth);
  if (!top || !middle) return;
  const tint = sees ? [255, 247, 205] : [214, 226, 205];
  const light = withStops(d.createLinearGradient(top[0], top[1], middle[0], middle[1] + 1),
    [0, rgb(tint, sees ? 0.34 : 0.3)], [1, rgb(tint, sees ? 0.1 : 0)]);
  d.fillStyle = camera.forward[2] < -0.9 ? rgb(tint, 0.09) : light; // from above both ends of it coincide
  for (let n = 0; n < 4; n++) {
    d.beginPath();
    if (polygon(d, camera, [eye, base[n], base[(n + 1) % 4]])) d.fill();
  }
  d.beginPath();
  if (!polygon(d, camera, square(pose.x, pose.y, altitude * TANGENT))) return;
  if (sees) {
    d.fillStyle = 'rgba(255,246,196,0.30)';
    d.fill();
    d.lineWidth = 1.8;
    d.strokeStyle = 'rgba(255,250,224,0.95)';
    d.stroke();
  } else {
    d.setLineDash([5, 5]);
    d.lineWidth = 1.3;
    d.strokeStyle = 'rgba(255,160,132,0.9)';
    d.stroke();
    d.setLineDash([]);
  }
}

function drawVehicle({ d, camera, moment, water, clarity }) {
  const { turn, place } = bodyToWorld(moment.pose, VEHICLE_SCALE);
  const shapes = [];
  for (const face of HULL) {
    const normal = turn(face.normal);
    const points = face.points.map(place);
    const centre = points[0].map((_, axis) => points.reduce((sum, point) => sum + point[axis], 0) / 4);
    const towards = centre.map((value, axis) => camera.eye[axis] - value);
    if (dot(normal, towards) <= 0) continue;
    const tint = mixed(face.tint, water.far, 0.1 + 0.12 * (1 - clarity));
    shapes.push({ depth: Math.hypot(...towards), draw: () => {
      d.beginPath();
      if (!polygon(d, camera, points)) return;
      d.fillStyle = shade(tint, normal, 1.12);
      d.fill();
      d.lineWidth = 0.6;
      d.strokeStyle = 'rgba(3,24,32,0.55)';
      d.stroke();
    } });
  }
  THRUSTER_PLACES.forEach(([at, axis], number) => {
    const centre = place(at);
    const depth = Math.hypot(...centre.map((value, index) => camera.eye[index] - value)) - 0.06;
    shapes.push({ depth, draw: () => drawThruster(d, camera, turn(axis), centre, moment, number) });
  });
  shapes.sort((one, other) => other.depth - one.depth).forEach((shape) => shape.draw());
  const lamp = camera.project(...place([0.24, 0, 0.0]));
  if (lamp) {
    d.globalCompositeOperation = 'screen';
    drawGlow(d, lamp, lamp[3] * 0.5, 'rgba(224,252,255,0.55)', 'rgba(224,252,255,0)');
    d.globalCompositeOperation = 'source-over';
  }
}

function drawThruster(d, camera, axis, centre, moment, number) {
  const works = moment.thrusters[number] !== false;
  const radius = 0.062 * VEHICLE_SCALE;
  const side = Math.abs(axis[2]) > 0.9 ? [1, 0, 0] : [-axis[1], axis[0], 0];
  const other = [
    axis[1] * side[2] - axis[2] * side[1], axis[2] * side[0] - axis[0] * side[2], axis[0] * side[1] - axis[1] * side[0],
  ];
  const ring = (share, angle) => centre.map(
    (value, k) => value + radius * share * (Math.cos(angle) * side[k] + Math.sin(angle) * other[k]));
  d.beginPath();
  if (!polygon(d, camera, Array.from({ length: 14 }, (_, n) => ring(1, (n * Math.PI) / 7)))) return;
  d.fillStyle = works ? 'rgba(5,34,42,0.95)' : 'rgba(60,8,4,0.95)';
  d.fill();
  d.lineWidth = 2;
  d.strokeStyle = works ? '#3cf0e0' : '#ff5a3c';
  d.stroke();
  d.lineWidth = 1.6;
  for (let blade = 0; blade < 3; blade++) {
    const angle = (works ? moment.t * 9 + number : 0.6) + (blade * 2 * Math.PI) / 3;
    const [from, to] = [camera.project(...ring(0.12, angle)), camera.project(...ring(0.82, angle))];
    if (!from || !to) continue;
    d.strokeStyle = works ? 'rgba(150,255,245,0.85)' : 'rgba(255,120,96,0.8)';
    strokeLine(d, from, to);
  }
  if (works) return;
  const at = camera.project(...centre);
  if (!at) return;
  drawGlow(d, at, at[3] * 0.3, `rgba(255,70,40,${0.5 + 0.25 * Math.sin(moment.t * 5)})`, 'rgba(255,70,40,0)');
}

/** Particles in the water: the more, the murkier. */
function drawSnow({ d, camera, view, moment, clarity }) {
  const [size, tall] = [13, 6];
  const count = Math.round(mix(420, 110, clarity));
  d.fillStyle = 'rgb(232,246,238)';
  for (let n = 0; n < count; n++) {
    const wrap = (value, middle, width) => middle + ((((value - middle) % width) + 1.5 * width) % width) - width / 2;
    const x = wrap(hash(n, 11) * size + moment.t * 0.05, view.target[0], size);
    const y = wrap(hash(n, 12) * size + 0.3 * Math.sin(moment.t * 0.13 + n), view.target[1], size);
    const z = wrap(hash(n, 13) * tall - moment.t * 0.02, BED + tall / 2, tall);
    const at = camera.project(x, y, z);
    if (!at || at[2] < 0.8) continue;
    d.globalAlpha = clamp(0.62 - at[2] * 0.035, 0.05, 0.5);
    const broad = clamp(at[3] * (0.008 + 0.01 * hash(n, 14)), 0.5, 3.2);
    d.fillRect(at[0], at[1], broad, broad);
  }
  d.globalAlpha = 1;
}

function drawMurk({ d, width, height, water, clarity, camera, moment }) {
  const { pose } = moment;
  const at = camera.project(pose.x, pose.y, pose.z) ?? [width / 2, height / 2];
  d.fillStyle = withStops(
    d.createRadialGradient(at[0], at[1], height * 0.12, at[0], at[1], Math.max(width, height) * 0.75),
    [0, rgb(water.far, 0.02 + 0.1 * (1 - clarity))],
    [0.55, rgb(mixed(water.far, water.deep, 0.45), 0.1 + 0.24 * (1 - clarity))],
    [1, rgb(water.deep, 0.45 + 0.28 * (1 - clarity))],
  );
  d.fillRect(0, 0, width, height);
  d.fillStyle = withStops(d.createLinearGradient(0, 0, 0, height),
    [0, 'rgba(2,26,36,0.42)'], [0.25, 'rgba(2,26,36,0)'], [0.72, 'rgba(2,26,36,0)'], [1, 'rgba(2,26,36,0.62)']);
  d.fillRect(0, 0, width, height);
}
