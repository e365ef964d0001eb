// Plays the missions: the time, the controls, and what is drawn when.

const SPEEDS = [1, 2, 4, 8, 16];
const VIEWS = [['3d', '3-D'], ['above', 'Above'], ['side', 'Side']];
const PRESETS = {
  '3d': { azimuth: 0.62, pitch: 0.5, distance: 6.6 },
  above: { azimuth: Math.PI / 2, pitch: 1.5, distance: 11 },
  side: { azimuth: Math.PI / 2, pitch: 0.1, distance: 7 },
};

function prepare(mission) {
  const { track } = mission;
  const play = { mission, track, manager: mission.metrics.manager, duration: track.t_s.at(-1) };
  const usual = ['t_s', 'x_m', 'y_m', 'z_m', 'roll_rad', 'pitch_rad', 'yaw_rad', 'mode', 'visibility_m'];
  play.further = Object.keys(track).filter((name) => !usual.includes(name));
  play.indexAt = (t) => Math.max(0, lastAt(track.t_s, t, (each) => each));
  const ends = (values) => values.reduce(([low, high], each) => [Math.min(low, each), Math.max(high, each)], [Infinity, -Infinity]);
  const [murkiest, clearest] = ends(track.visibility_m.filter((each) => each !== null));
  play.clearest = Math.max(0.1, clearest);
  play.murkiest = Math.min(murkiest, play.clearest);
  play.top = Math.max(1, play.clearest, ends(track.z_m)[1] - BED) * 1.1;
  play.swath = [];
  for (let i = 0; i < track.t_s.length; i += 4) {
    const altitude = track.z_m[i] - BED;
    if (track.visibility_m[i] !== null && altitude <= track.visibility_m[i]) {
      play.swath.push({ x: track.x_m[i], y: track.y_m[i], half: altitude * TANGENT, t: track.t_s[i] });
    }
  }
  const [x0, x1] = ends([...track.x_m, ...PIPELINE.map((each) => each[0])]);
  const [y0, y1] = ends([...track.y_m, ...PIPELINE.map((each) => each[1])]);
  play.bounds = { x0: x0 - 1, x1: x1 + 1, y0: y0 - 1, y1: y1 + 1 };
  const lengths = mission.way.map(([x, y]) => lengthAlong(x, y));
  let [from, to] = [Infinity, -Infinity];
  play.inspected = mission.inspected.map(([t, point, distance]) => {
    [from, to] = [Math.min(from, lengths[point]), Math.max(to, lengths[point])];
    return { t, from, to, distance };
  });
  const { cycles } = mission.cycles;
  const factsOf = (cycle) => (mission.cycles.inferences[cycle?.inferred ?? -1]?.facts ?? []).map((each) => each.fact);
  play.happenings = cycles.map((cycle, n) => {
    const changes = cycle.decided.some((each) => each.chosen !== null && each.chosen !== each.before);
    const isNew = factsOf(cycle).some((fact) => !factsOf(cycles[n - 1]).includes(fact));
    return changes || isNew ? cycle : null;
  });
  play.requests = [];
  for (const [t, , event, detail] of mission.events) {
    if (event === 'mode_requested') play.requests.push({ t, change: detail.replace(' -> ', ' → '), set: Infinity });
    if (event === 'mode_set') {
      const change = detail.replace(' = ', ' → ');
      const open = play.requests.findLast((each) => each.change === change && each.set === Infinity);
      if (open) open.set = t;
    }
  }
  play.troubles = troublesOf(play);
  play.marks = [
    ...play.troubles.map((each) => ({ t: each.from, kind: 'trouble' })),
    ...mission.adaptations.map((t) => ({ t, kind: 'adaptation' })),
    ...mission.thrusters.filter(([, , works]) => !works).map(([t]) => ({ t, kind: 'failure' })),
    ...(mission.seen ? [{ t: mission.seen[0], kind: 'seen' }] : []),
  ];
  play.view = { ...PRESETS['3d'], target: null };
  return play;
}

const GROUND_M = 0.2;
const LYING_S = 5;

/** What went wrong, with the times between which it lasted: no design was left, or the vehicle lay on the ground. */
function troublesOf({ mission, track, duration }) {
  const found = [];
  const open = new Map();
  const note = (text, t, holds, least = 0) => {
    if (holds && !open.has(text)) open.set(text, t);
    if (holds || !open.has(text)) return;
    if (t - open.get(text) >= least) found.push({ text, from: open.get(text), to: t });
    open.delete(text);
  };
  for (const { t_s: t, decided } of mission.cycles.cycles) {
    for (const each of decided) note(`no design is left for ${each.function}`, t, each.chosen === null);
  }
  for (const text of [...open.keys()]) note(text, duration, false);
  track.t_s.forEach((t, n) => note('the vehicle lies on the ground', t, track.z_m[n] - BED < GROUND_M, LYING_S));
  note('the vehicle lies on the ground', duration, false, LYING_S);
  return found;
}

function momentOf(play, asked) {
  const { track, mission } = play;
  const t = clamp(asked, 0, play.duration);
  const index = play.indexAt(t);
  const next = Math.min(index + 1, track.t_s.length - 1);
  const share = next > index ? clamp((t - track.t_s[index]) / (track.t_s[next] - track.t_s[index]), 0, 1) : 0;
  const between = (values) => mix(values[index], values[next], share);
  const turned = track.yaw_rad[next] - track.yaw_rad[index];
  const turn = Math.atan2(Math.sin(turned), Math.cos(turned));
  const pose = {
    x: between(track.x_m), y: between(track.y_m), z: between(track.z_m),
    roll: between(track.roll_rad), pitch: between(track.pitch_rad), yaw: track.yaw_rad[index] + share * turn,
  };
  const visibility = track.visibility_m[index];
  const altitude = Math.max(0, pose.z - BED);
  const thrusters = Array(DATA.scenario.thrusters).fill(null);
  for (const [time, number, works] of mission.thrusters) if (time <= t) thrusters[number - 1] = works;
  const inspected = play.inspected[lastAt(play.inspected, t, (each) => each.t)];
  const spread = play.clearest - play.murkiest;
  const atEnd = t >= play.duration - 0.3;
  return {
    t, index, pose, altitude, visibility, thrusters, mode: track.mode[index],
    sees: visibility !== null && altitude <= visibility,
    further: Object.fromEntries(play.further.map((name) => [name, mission.track[name][index]])),
    clarity: visibility === null || spread < 0.05 ? 1 : clamp((visibility - play.murkiest) / spread, 0, 1),
    inspectedFrom: inspected?.from ?? Infinity, inspectedTo: inspected?.to ?? -Infinity,
    distance: atEnd ? mission.metrics.distance_inspected_m : (inspected?.distance ?? 0),
    isSeen: mission.seen !== null && t >= mission.seen[0], isOver: asked > play.duration,
  };
}

function makePane(play) {
  const canvas = (name, label) => element(`canvas.${name}`, { role: 'img', 'aria-label': label });
  const parts = {
    scene: canvas('scene', `The vehicle of ${play.manager} over the sea bed`), map: canvas('map', 'The mission from above'),
    side: canvas('profile', 'The vehicle from the side'), state: element('div.state'),
    altitude: element('b'), visibility: element('b'), mode: element('span.mode'),
    distance: element('b'), lamps: element('span.lamps'),
  };
  for (let n = 1; n <= DATA.scenario.thrusters; n++) parts.lamps.append(element('i', { title: `thruster ${n}` }, n));
  const figure = (label, value) => element('span.figure', element('small', label), value);
  const stage = element('div.stage', parts.scene, parts.map,
    element('div.hud.top', element('div.manager', play.manager), parts.state),
    element('div.hud.bottom', figure('altitude', parts.altitude), figure('visibility', parts.visibility),
      figure('inspected', parts.distance), figure('thrusters', parts.lamps), figure('mode', parts.mode)));
  parts.mode.parentElement.classList.add('word');
  const panel = makePanel(play);
  const box = element('article.pane', { 'aria-label': play.mission.name },
    element('div.world', stage, element('div.side', parts.side)), panel.box);
  lookAround(stage, play);
  return { play, box, parts, panel };
}

function lookAround(stage, play) {
  let from = null;
  stage.onpointerdown = (event) => {
    from = [event.clientX, event.clientY];
    stage.setPointerCapture(event.pointerId);
  };
  stage.onpointermove = (event) => {
    if (!from) return;
    play.view.azimuth -= (event.clientX - from[0]) * 0.007;
    play.view.pitch = clamp(play.view.pitch + (event.clientY - from[1]) * 0.006, 0.04, 1.5);
    from = [event.clientX, event.clientY];
    requestDraw();
  };
  stage.onpointerup = stage.onpointercancel = () => { from = null; };
  stage.addEventListener('wheel', (event) => {
    event.preventDefault();
    play.view.distance = clamp(play.view.distance * Math.exp(event.deltaY * 0.001), 2.5, 40);
    requestDraw();
  }, { passive: false });
}

function drawPane({ play, box, parts, panel }, t) {
  const moment = momentOf(play, t);
  const { pose } = moment;
  play.view.target = [pose.x, pose.y, mix(BED + 0.8, pose.z, 0.55)];
  const surfaces = [[parts.scene, drawScene, play.view], [parts.map, drawMap], [parts.side, drawSide]];
  for (const [canvas, draw, view] of surfaces) {
    const surface = fitted(canvas);
    if (surface) draw(surface, play, moment, view);
  }
  parts.altitude.textContent = `${moment.altitude.toFixed(1)} m`;
  parts.visibility.textContent = moment.visibility === null ? '–' : `${moment.visibility.toFixed(1)} m`;
  parts.visibility.classList.toggle('blind', moment.visibility !== null && !moment.sees);
  parts.distance.textContent = `${moment.distance.toFixed(1)} m`;
  parts.mode.replaceChildren(element('i'), moment.mode || 'no mode yet');
  parts.mode.firstChild.style.color = seaColour(moment.mode);
  [...parts.lamps.children].forEach((lamp, n) => lamp.classList.toggle('dead', moment.thrusters[n] === false));
  const { metrics } = play.mission;
  const trouble = play.troubles.findLast((each) => each.from <= t && t < each.to);
  const phase = moment.isOver ? 'mission is over'
    : moment.isSeen ? `pipeline found after ${foundAfter(metrics)}` : metrics.pipeline_found ? 'searching' : 'searching, until the time limit';
  parts.state.textContent = trouble ? `${phase}: ${trouble.text} (since ${trouble.from.toFixed(1)} s)` : phase;
  Object.assign(box.dataset, { x: pose.x.toFixed(3), y: pose.y.toFixed(3), z: pose.z.toFixed(3) });
  panel.update(moment);
}

const plays = DATA.missions.map(prepare);
const panes = plays.map(makePane);
const span = Math.max(...plays.map((play) => play.duration));
const state = { t: 0, speed: 4, isPlaying: false, drawnAt: null, requested: false };
let modeColour = null;

byId('panes').className = panes.length > 1 ? 'two' : 'one';
byId('panes').append(...panes.map((pane) => pane.box));
describe();

function foundAfter(metrics) {
  return `${Number(metrics.search_time_s).toFixed(1)} s`;
}

function describe() {
  const { scenario } = DATA;
  const metrics = plays.map((play) => play.mission.metrics);
  const same = (name) => metrics.every((each) => each[name] === metrics[0][name]);
  const shared = ['run', 'seed'].filter(same).map((name) => `${name} ${metrics[0][name]}`);
  byId('title').textContent = plays.map((play) => play.manager).join(' and ');
  const sameDraws = plays.length > 1 && shared.length === 2 ? ', the same random numbers' : '';
  const results = metrics.map((each) => `${plays.length > 1 ? `${each.manager}: ` : ''}${each.pipeline_found
    ? `found after ${foundAfter(each)}` : 'not found'}, ${Number(each.distance_inspected_m).toFixed(1)} m inspected`);
  byId('subtitle').textContent = [`${scenario.name}, ${shared.join(', ')}${sameDraws}`, ...results].join('  ·  ');
}

function draw() {
  state.requested = false;
  for (const pane of panes) drawPane(pane, state.t);
  const surface = fitted(byId('timeline'), plays.length > 1 ? 104 : 84);
  modeColour ??= modeColours();
  if (surface) drawTimeline(surface, plays, state.t, span, modeColour);
  byId('clock').replaceChildren(`${state.t.toFixed(1)} s`, element('small', ` of ${span.toFixed(0)} s`));
  const scrub = byId('scrub');
  scrub.value = state.t;
  scrub.setAttribute('aria-valuetext', `${state.t.toFixed(1)} seconds`);
  document.body.dataset.time = state.t.toFixed(2);
}

function requestDraw() {
  if (state.requested || state.isPlaying) return;
  state.requested = true;
  requestAnimationFrame(draw);
}

function goTo(t) {
  state.t = clamp(t, 0, span);
  requestDraw();
}

function setPlaying(isPlaying) {
  if (isPlaying && state.t >= span) state.t = 0;
  state.isPlaying = isPlaying;
  state.drawnAt = null;
  document.body.classList.toggle('playing', isPlaying);
  byId('play').setAttribute('aria-label', isPlaying ? 'Pause' : 'Play');
  if (isPlaying) requestAnimationFrame(advance);
  else requestDraw();
}

function advance(now) {
  if (!state.isPlaying) return;
  const passed = state.drawnAt === null ? 0 : Math.min(0.25, (now - state.drawnAt) / 1000) * state.speed;
  state.drawnAt = now;
  const stop = byId('stops').checked ? nextStop(state.t, 1) : Infinity;
  state.t = Math.min(state.t + passed, stop, span);
  draw();
  if (state.t >= span || state.t >= stop) setPlaying(false);
  else requestAnimationFrame(advance);
}

const STOPS = [...new Set(plays.flatMap((play) => play.mission.adaptations))].sort((a, b) => a - b);
function nextStop(t, direction) {
  return direction > 0 ? (STOPS.find((each) => each > t + 0.05) ?? span) : (STOPS.findLast((each) => each < t - 0.05) ?? 0);
}

const setView = choice(byId('views'), VIEWS.map(([value, label], n) => [value, label, `Key ${n + 1}`]), '3d', (name) => {
  for (const play of plays) Object.assign(play.view, PRESETS[name]);
  requestDraw();
});
const chooseSpeed = choice(byId('speeds'), SPEEDS.map((each) => [each, `${each}×`, `${each} times as fast as the mission`]),
  state.speed, (speed) => { state.speed = speed; });

function enlarge() {
  const isLarge = document.documentElement.classList.toggle('large');
  byId('large').setAttribute('aria-pressed', isLarge);
  requestDraw();
}

/** Hide what explains the mission, so that who watches has to: panels, marks, modes, and what is still to come. */
function hideWords() {
  document.documentElement.classList.toggle('wordless');
  requestDraw();
}

const changeSpeed = (by) => chooseSpeed(SPEEDS[clamp(SPEEDS.indexOf(state.speed) + by, 0, SPEEDS.length - 1)]);
const KEYS = {
  ' ': () => setPlaying(!state.isPlaying), k: () => setPlaying(!state.isPlaying),
  ArrowLeft: (event) => goTo(state.t - (event.shiftKey ? 10 : 1)), ArrowRight: (event) => goTo(state.t + (event.shiftKey ? 10 : 1)),
  Home: () => goTo(0), End: () => goTo(span), n: () => goTo(nextStop(state.t, 1)), p: () => goTo(nextStop(state.t, -1)),
  '+': () => changeSpeed(1), '=': () => changeSpeed(1), '-': () => changeSpeed(-1), l: toggleTheme, b: enlarge, w: hideWords,
  1: () => setView('3d'), 2: () => setView('above'), 3: () => setView('side'), '?': () => byId('help').showModal(),
};
addEventListener('keydown', (event) => {
  const action = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action || event.ctrlKey || event.metaKey || event.altKey || byId('help').open) return;
  if (event.key === ' ' && event.target.matches('button, summary, input[type=checkbox]') && event.target.id !== 'play') return;
  event.preventDefault();
  action(event);
});
byId('play').onclick = KEYS.k;
byId('play').onkeyup = (event) => { if (event.key === ' ') event.preventDefault(); };
byId('before').onclick = KEYS.p;
byId('after').onclick = KEYS.n;
byId('large').onclick = enlarge;
byId('help-button').onclick = KEYS['?'];
byId('scrub').max = span;
byId('scrub').oninput = (event) => goTo(Number(event.target.value));
addEventListener('resize', requestDraw);
themeListeners.push(() => { modeColour = null; showLegend(byId('legend'), plays); requestDraw(); });
startTheme(byId('theme'));

const asked = new URLSearchParams(location.hash.slice(1));
if (asked.has('view') && asked.get('view') in PRESETS) setView(asked.get('view'));
if (SPEEDS.includes(Number(asked.get('speed')))) chooseSpeed(Number(asked.get('speed')));
goTo(Number(asked.get('t')) || 0);
draw();
if (asked.get('large')) enlarge();
if (asked.get('play')) setPlaying(true);
