// The small map from above, the view from the side, and the timeline.

function lengthAlong(x, y) {
  let best = [Infinity, 0];
  for (const { from, to, start } of PIECES) {
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    const whole = Math.hypot(dx, dy);
    const share = clamp(((x - from[0]) * dx + (y - from[1]) * dy) / (whole * whole), 0, 1);
    const away = Math.hypot(x - from[0] - share * dx, y - from[1] - share * dy);
    if (away < best[0]) best = [away, start + share * whole];
  }
  return best[1];
}

/** The whole mission from above. */
function drawMap({ drawing: d, width, height }, play, moment) {
  d.clearRect(0, 0, width, height);
  const { bounds: { x0, x1, y0, y1 }, track } = play;
  const margin = 11;
  const scale = Math.min((width - 2 * margin) / (x1 - x0), (height - 2 * margin) / (y1 - y0));
  const at = (x, y) => [width / 2 + (x - (x0 + x1) / 2) * scale, height / 2 - (y - (y0 + y1) / 2) * scale];
  d.fillStyle = 'rgba(190,246,255,0.16)';
  d.beginPath();
  for (const { x, y, half, t } of play.swath) {
    if (t > moment.t) break;
    const [px, py] = at(x - half, y + half);
    d.rect(px, py, 2 * half * scale, 2 * half * scale);
  }
  d.fill('nonzero');
  d.lineCap = d.lineJoin = 'round';
  for (const seen of [false, true]) {
    d.strokeStyle = seen ? '#ffb22e' : '#8fa3a6';
    d.lineWidth = seen ? 3.4 : 2.6;
    d.beginPath();
    for (const piece of PIECES) {
      if (seen && !isInspected(piece, moment)) continue;
      d.moveTo(...at(...piece.from));
      d.lineTo(...at(...piece.to));
    }
    d.stroke();
  }
  d.lineWidth = 1.3;
  for (let i = 4; i <= moment.index; i += 4) {
    d.strokeStyle = seaColour(track.mode[i]);
    strokeLine(d, at(track.x_m[i - 4], track.y_m[i - 4]), at(track.x_m[i], track.y_m[i]));
  }
  const { pose, altitude } = moment;
  const [x, y] = at(pose.x, pose.y);
  const half = altitude * TANGENT * scale;
  d.strokeStyle = 'rgba(255,250,224,0.9)';
  d.lineWidth = 1;
  d.strokeRect(x - half, y - half, 2 * half, 2 * half);
  d.fillStyle = '#fff';
  const corner = (turn, far) => [x + far * Math.cos(pose.yaw + turn), y - far * Math.sin(pose.yaw + turn)];
  tracePath(d, corner(0, 6), corner(2.5, 4.6), corner(-2.5, 4.6));
  d.fill();
  d.font = '10px system-ui, sans-serif';
  d.fillStyle = '#eafaff';
  d.fillText('from above', 8, height - 8);
  const five = 5 * scale;
  d.fillRect(width - 10 - five, height - 9, five, 1.5);
  d.textAlign = 'right';
  d.fillText('5 m', width - 10, height - 13);
  d.textAlign = 'left';
}

/** From the side: altitude over the last seconds, and how high the vehicle may be to see the sea bed. */
function drawSide({ drawing: d, width, height }, play, moment) {
  const { track } = play;
  const [before, after] = [34, 12];
  const floor = height - 16;
  const metre = (floor - 14) / play.top;
  const across = (t) => ((t - moment.t + before) / (before + after)) * width;
  const up = (metres) => floor - metres * metre;
  d.fillStyle = withStops(d.createLinearGradient(0, 0, 0, floor), [0, '#0e5a73'], [1, '#0b4156']);
  d.fillRect(0, 0, width, floor);
  const first = Math.max(0, play.indexAt(moment.t - before) - 1);
  const last = Math.min(track.t_s.length - 1, play.indexAt(moment.t + after) + 1);
  d.beginPath(); // where the water hides the sea bed
  d.moveTo(across(track.t_s[first]), 0);
  for (let i = first; i <= last; i++) {
    d.lineTo(across(track.t_s[i]), up(track.visibility_m[i] ?? play.top));
  }
  d.lineTo(across(track.t_s[last]), 0);
  d.closePath();
  d.fillStyle = withStops(d.createLinearGradient(0, 0, 0, floor), [0, 'rgba(96,112,84,0.95)'], [1, 'rgba(96,112,84,0.72)']);
  d.fill();
  d.strokeStyle = 'rgba(226,238,200,0.65)';
  d.lineWidth = 1;
  d.setLineDash([4, 4]);
  d.stroke();
  d.setLineDash([]);
  d.fillStyle = '#c7b58a';
  d.fillRect(0, floor, width, height - floor);
  d.fillStyle = 'rgba(60,50,20,0.28)';
  for (let n = Math.floor(moment.t - before) - 1; n < moment.t + after + 1; n++) {
    d.fillRect(across(n + hash(n, 21)), floor + 3 + 9 * hash(n, 22), 2 + 9 * hash(n, 23), 1.4);
  }
  d.lineWidth = 2.4;
  d.lineCap = 'round';
  for (let i = first + 1; i <= moment.index; i++) {
    d.strokeStyle = seaColour(track.mode[i]);
    strokeLine(d, [across(track.t_s[i - 1]), up(track.z_m[i - 1] - BED)], [across(track.t_s[i]), up(track.z_m[i] - BED)]);
  }
  const { altitude, visibility, sees } = moment;
  const [x, y] = [across(moment.t), up(altitude)];
  const deep = sees || visibility === null ? altitude : visibility;
  d.fillStyle = withStops(d.createLinearGradient(0, y, 0, up(altitude - deep) + 1),
    [0, sees ? 'rgba(255,248,210,0.75)' : 'rgba(255,236,210,0.6)'], [1, sees ? 'rgba(255,248,210,0.22)' : 'rgba(255,236,210,0)']);
  const [half, foot] = [deep * TANGENT * metre, up(altitude - deep)];
  tracePath(d, [x, y], [x - half, foot], [x + half, foot]);
  d.fill();
  d.fillStyle = sees ? '#fff3c0' : '#ff9c7a';
  d.fillRect(x - altitude * TANGENT * metre, floor - 1.5, 2 * altitude * TANGENT * metre, 3);
  d.fillStyle = '#2f8fe8';
  d.beginPath();
  d.roundRect(x - 12, y - 7, 24, 6, 2.5);
  d.fill();
  d.fillStyle = '#20303a';
  d.fillRect(x - 12, y - 1, 24, 5);
  d.fillStyle = '#9ee8ff';
  d.fillRect(x + 9, y - 1, 4, 4);
  d.font = '10px system-ui, sans-serif';
  d.fillStyle = '#fff';
  d.fillText('from the side', 8, 14);
  for (let metres = 1; metres <= play.top; metres++) {
    d.fillRect(width - 6, up(metres), 6, 1);
    if (metre > 13) d.fillText(`${metres} m`, width - 27, up(metres) + 3.5);
  }
  if (visibility !== null && width > 420) {
    d.textAlign = 'right';
    const far = 'too high to see the sea bed';
    const words = sees ? 'above the dashed line the sea bed is out of sight' : moment.distance > 0 ? `${far}; inspected counts way-points passed` : far;
    d.fillStyle = sees ? '#fff' : '#ffe3d8';
    d.fillText(words, width - 40, 14);
    d.textAlign = 'left';
  }
}

/** Marks of the timeline: SVG paths around their middle. They differ without colour, too. */
const MARKS = {
  adaptation: { colour: '--ink', path: 'M0 3 -4-4H4Z', words: 'adaptation' },
  failure: { colour: '--bad', path: 'M0-5 5 0 0 5-5 0Z', words: 'thruster fails' },
  trouble: { colour: '--warm', path: 'M-4-4H4V4H-4Z', words: 'no design left, or on the ground' },
  seen: { colour: '--good', path: 'M-4 0A4 4 0 0 1 4 0 4 4 0 0 1-4 0Z', words: 'pipeline found' },
};

/** What the lines and marks of the timeline mean, of those that are in it. */
function showLegend(box, plays) {
  const drawn = (kind, attributes) => {
    const made = document.createElementNS('http://www.w3.org/2000/svg', kind);
    setAttributes(made, attributes);
    return made;
  };
  const entry = (words, kind, attributes) => {
    const svg = drawn('svg', { viewBox: '0 0 16 11' });
    svg.append(drawn(kind, attributes));
    return element('span', svg, words);
  };
  const kinds = Object.keys(MARKS).filter((kind) => plays.some((play) => play.marks.some((mark) => mark.kind === kind)));
  const modes = [...new Set(plays.flatMap((play) => play.track.mode))].filter((mode) => mode);
  box.replaceChildren(
    ...kinds.map((kind) => {
      const { colour: name, path, words } = MARKS[kind];
      return entry(words, 'path', { d: path, transform: 'translate(8 5.5)', fill: colour(name) });
    }),
    entry('visibility', 'rect', { y: 2, width: 16, height: 8, fill: colour('--line') }),
    element('span', 'altitude in'), ...modes.map((mode) => entry(mode, 'path', { d: 'M0 6H16', stroke: modeColours()(mode), 'stroke-width': 3 })),
  );
}

/** Altitude and visibility of every mission over the whole time, with what happened. */
function drawTimeline(surface, plays, t, span, modeColour) {
  const { drawing: d, width, height } = surface;
  const isWordless = document.documentElement.classList.contains('wordless');
  d.clearRect(0, 0, width, height);
  const axis = height - 17;
  const lane = axis / plays.length;
  const across = (time) => (time / span) * width;
  d.font = '10.5px system-ui, sans-serif';
  plays.forEach((play, number) => {
    const { track } = play;
    const [top, bottom] = [number * lane + 13, (number + 1) * lane - 7];
    const up = (metres) => bottom - (metres / play.top) * (bottom - top);
    d.fillStyle = colour('--line');
    d.globalAlpha = 0.62;
    d.beginPath();
    d.moveTo(0, bottom);
    for (let i = 0; i < track.t_s.length; i += 4) d.lineTo(across(track.t_s[i]), up(track.visibility_m[i] ?? 0));
    d.lineTo(across(track.t_s.at(-1)), bottom);
    d.fill();
    d.globalAlpha = 1;
    for (let i = 4; i < track.t_s.length; i += 4) {
      d.strokeStyle = isWordless ? colour('--soft') : modeColour(track.mode[i]);
      d.globalAlpha = track.t_s[i] <= t ? 1 : isWordless ? 0 : 0.42;
      d.lineWidth = 1.9;
      strokeLine(d, [across(track.t_s[i - 4]), up(track.z_m[i - 4] - BED)], [across(track.t_s[i]), up(track.z_m[i] - BED)]);
      if (isWordless) continue;
      d.fillStyle = modeColour(track.mode[i]);
      d.fillRect(across(track.t_s[i - 4]), bottom + 1.5, across(track.t_s[i]) - across(track.t_s[i - 4]) + 0.4, 3);
    }
    d.globalAlpha = 1;
    for (const mark of isWordless ? [] : play.marks) {
      const x = across(mark.t);
      d.fillStyle = colour(MARKS[mark.kind].colour);
      d.translate(x, top - 5);
      d.fill(new Path2D(MARKS[mark.kind].path));
      d.translate(-x, 5 - top);
      if (mark.kind !== 'adaptation') d.fillRect(x - 0.5, top - 4, 1, bottom - top + 4);
    }
    if (plays.length > 1) {
      // Above the curves, and on a ground of its own, so that neither they nor marks strike it through.
      d.textAlign = 'right';
      Object.assign(d, { fillStyle: colour('--soft'), strokeStyle: colour('--card'), lineWidth: 4, lineJoin: 'round' });
      d.strokeText(play.manager, width - 4, top - 2);
      d.fillText(play.manager, width - 4, top - 2);
      d.textAlign = 'left';
    }
  });
  d.fillStyle = colour('--soft');
  const step = [5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600].find((each) => across(each) > 52) ?? span;
  for (let time = 0; time <= span; time += step) {
    d.fillRect(across(time), axis - 2, 1, 4);
    d.textAlign = time === 0 ? 'left' : across(time) > width - 18 ? 'right' : 'center';
    d.fillText(time === 0 ? '0 s' : String(time), across(time), height - 3);
  }
  d.textAlign = 'left';
  d.fillStyle = colour('--accent');
  d.fillRect(across(t) - 1, 0, 2, axis);
  d.beginPath();
  d.arc(across(t), axis, 5, 0, 7);
  d.fill();
}
