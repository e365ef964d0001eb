// The report: what is chosen, and the charts and tables that follow from it.

const { results, ways, made } = DATA;
const { drawn } = results;
const { columns, titles } = drawn;
const METRICS = Object.keys(titles);
const state = { hidden: new Set(), metric: METRICS[0], found: 'all', sweep: {}, reference: 0, run: null, group: null };
const seedOf = (row) => columns.seed[columns.seed.length === 1 ? 0 : row];
const shownGroups = () => groups.map((_, number) => number).filter((number) => !state.hidden.has(number));

function rowsOf(number) {
  return columns.group.map((_, row) => row).filter((row) => columns.group[row] === number
    && (state.found === 'all' || String(columns.found[row]) === state.found)
    && drawn.swept.every((name) => !state.sweep[name] || String(columns[name][row]) === state.sweep[name]));
}
let chosen = new Map();
const ofMetric = (row) => columns[state.metric][row];
const known = (rows, name) => rows.filter((row) => columns[name][row] !== null);

function refresh() {
  chosen = new Map(shownGroups().map((number) => [number, rowsOf(number)]));
  const count = [...chosen.values()].reduce((sum, rows) => sum + rows.length, 0);
  const every = drawn.every > 1 ? ` (each ${drawn.every}th run of ${drawn.missions.toLocaleString('en')} missions)` : '';
  byId('count').textContent = `${count.toLocaleString('en')} missions${every}`;
  drawDistribution();
  drawSpread();
  drawSweep();
  drawPaired();
  drawWhere();
  drawRuns();
  drawRun();
}

function drawDistribution() {
  const traces = [];
  for (const [number, rows] of chosen) {
    const { name, color, dash } = lookOf(number);
    const values = known(rows, state.metric).map(ofMetric);
    if (!values.length) continue;
    traces.push({
      ...distribution(values), mode: 'lines', name,
      line: { color, width: 2.2, shape: 'hv', dash },
      hovertemplate: '%{y:.1%} at or below %{x:.4~g}<extra>%{fullData.name}</extra>',
    });
  }
  byId('ecdf-title').textContent = `Distribution: ${titles[state.metric]}`;
  show('ecdf', traces, layoutOf(titles[state.metric], 'share of missions at or below', {
    yaxis: { range: [0, 1.02], tickformat: '.0%' },
  }));
}

function drawSpread() {
  const traces = [];
  for (const [number, rows] of chosen) {
    const { name, color } = lookOf(number);
    const some = thinned(known(rows, state.metric), 400);
    if (!some.length) continue;
    const all = known(rows, state.metric).map(ofMetric);
    const shared = { name, hoverinfo: 'x+name' };
    traces.push({
      ...shared, type: 'violin', x: thinned(all, 4000), y0: number, orientation: 'h', side: 'positive', width: 1.15, points: false,
      fillcolor: fade(color, 0.28), line: { color, width: 1.4 }, spanmode: 'hard',
      box: { visible: true, width: 0.16, fillcolor: colour('--card'), line: { color: colour('--ink'), width: 1.1 } }, hoveron: 'violins',
    }, {
      ...shared, mode: 'markers', x: some.map(ofMetric), customdata: some,
      y: some.map((row) => number - 0.12 - 0.24 * jitter(row)), marker: { size: 3.6, color, opacity: 0.5 },
      hovertemplate: '%{x:.4~g}<extra>run %{text}</extra>', text: some.map((row) => columns.run[row]),
    });
    traces.push({
      ...shared, mode: 'markers', x: [mean(all)], y: [number], marker: { symbol: 'diamond', size: 9, color: colour('--ink') },
      hovertemplate: 'mean %{x:.2f}<extra>%{fullData.name}</extra>',
    });
  }
  byId('spread-title').textContent = `Spread: ${titles[state.metric]}; box: quartiles, diamond: mean`;
  show('spread', traces, layoutOf(titles[state.metric], '', {
    yaxis: { tickvals: shownGroups(), ticktext: shownGroups().map((number) => plain(short(groups[number]))), zeroline: false, showgrid: false, automargin: true,
      range: [Math.min(...shownGroups()) - 0.55, Math.max(...shownGroups()) + 0.85] },
  }));
  onClick('spread', pick);
}

const short = (name) => (name.length > 22 ? `${name.slice(0, 21)}…` : name);
const jitter = (row) => { const value = Math.sin(row * 12.9898) * 43758.5453; return value - Math.floor(value); };
function fade(hex, alpha) {
  const [r, g, b] = [1, 3, 5].map((place) => parseInt(hex.slice(place, place + 2), 16));
  return `rgba(${r},${g},${b},${alpha})`;
}

/** Means over a swept parameter; each point has runs of its own, so their mean has an ordinary interval. */
function drawSweep() {
  const swept = drawn.swept.find((each) => !state.sweep[each]);
  byId('sweep-box').hidden = !swept;
  if (!swept) return;
  const traces = [];
  for (const [number, rows] of chosen) {
    const { name, color, dash, symbol } = lookOf(number);
    const byValue = new Map();
    for (const row of known(rows, state.metric)) {
      const [value, run] = [columns[swept][row], `${columns.run[row]}|${seedOf(row)}`];
      if (!byValue.has(value)) byValue.set(value, new Map());
      const byRun = byValue.get(value);
      byRun.set(run, [...(byRun.get(run) ?? []), ofMetric(row)]);
    }
    const values = [...byValue.keys()].sort((a, b) => (typeof a === 'number' ? a - b : 0));
    const samples = values.map((value) => [...byValue.get(value).values()].map(mean)); // points of a sweep share a run's draws
    traces.push({
      mode: 'lines+markers', name, x: values, y: samples.map(mean),
      error_y: { type: 'data', array: samples.map(halfInterval), color, thickness: 1.3, width: 4 },
      text: samples.map((sample) => `± ${halfInterval(sample)?.toFixed(2) ?? '?'}, ${sample.length} runs`),
      line: { color, width: 2, dash },
      hovertemplate: '%{y:.2f} %{text} at %{x}<extra>%{fullData.name}</extra>', marker: { symbol, size: 7 },
    });
  }
  const others = drawn.swept.filter((each) => each !== swept && !state.sweep[each]);
  byId('sweep-title').textContent = `Means and 95% intervals over ${swept}${others.length ? `, averaged over ${others.join(', ')}` : ''}`;
  show('sweep', traces, layoutOf(swept, titles[state.metric]));
}

function drawPaired() {
  byId('paired-box').hidden = !drawn.is_paired;
  if (!drawn.is_paired) return;
  const key = (row) => [columns.run[row], seedOf(row), ...drawn.swept.map((name) => columns[name][row])].join('|');
  const reference = new Map(rowsOf(state.reference).map((row) => [key(row), ofMetric(row)]));
  const traces = [];
  for (const [number, rows] of chosen) {
    const { name, color } = lookOf(number);
    if (number === state.reference) continue;
    const differences = [];
    for (const row of known(rows, state.metric)) {
      const other = reference.get(key(row));
      if (other !== undefined && other !== null) differences.push(ofMetric(row) - other);
    }
    if (!differences.length) continue;
    const half = drawn.swept.some((name) => !state.sweep[name]) ? null : halfInterval(differences);
    traces.push({
      type: 'histogram', x: differences, name, opacity: 0.62, nbinsx: 45, histnorm: 'percent',
      marker: { color, line: { color: colour('--card'), width: 0.6 } },
      hovertemplate: `%{y:.1f}% of ${differences.length.toLocaleString('en')} pairs<br>differ by %{x}<extra>%{fullData.name}</extra>`,
    }, {
      mode: 'markers', x: [mean(differences)], y: [0], name, cliponaxis: false,
      error_x: { type: 'data', array: [half], color: colour('--ink') },
      marker: { symbol: 'triangle-up', size: 12, color, line: { color: colour('--card'), width: 1 } },
      hovertemplate: `mean difference %{x:.2f}${half === null ? '' : ` ± ${half.toFixed(2)}`}<extra>%{fullData.name}</extra>`,
    });
  }
  show('paired', traces, layoutOf(`${titles[state.metric]}: difference to ${plain(groups[state.reference])}`, 'share of pairs (%)', {
    barmode: 'overlay', shapes: [{ type: 'line', x0: 0, x1: 0, yref: 'paper', y0: 0, y1: 1, line: { color: colour('--ink'), width: 1.2 } }],
  }));
}

function pipelineTrace() {
  return {
    mode: 'lines', x: ways.pipeline.map((each) => each[0]), y: ways.pipeline.map((each) => each[1]),
    line: { color: colour('--mode-idle'), width: 7 }, name: 'pipeline', hoverinfo: 'name',
  };
}

/** A map from above, to scale. */
function showMap(id, traces) {
  show(id, [pipelineTrace(), ...traces], layoutOf('x, east (m)', 'y, north (m)', { yaxis: { scaleanchor: 'x', scaleratio: 1 } }));
}

const runsWithWay = [...new Set(ways.paths.map((way) => way.run))];
const otherWays = 'suave-des report --paths N adds those of N runs';

function sayWhichWays() {
  const n = runsWithWay.length;
  const some = `${n} run${n > 1 ? 's' : ''} of each manager`;
  byId('runs-title').textContent = `Each mission; click one to view it${n ? `, with path and timeline of ${some}` : `. ${ways.note}`}`;
  byId('where-title').textContent = `Paths of ${some}, from above`;
}

function drawWhere() {
  byId('where-box').hidden = !ways.paths.length;
  if (!ways.paths.length) return;
  showMap('where', ways.paths.filter((way) => chosen.has(way.group)).map(({ group, run, x_m: x, y_m: y }) => {
    const { name, color, dash } = lookOf(group);
    return {
      mode: 'lines', x, y, name: `${name}, run ${run}`, opacity: 0.6, line: { color, width: 1.3, dash }, hoverinfo: 'name',
      customdata: x.map(() => [group, run]),
    };
  }));
  onClick('where', ([group, run] = []) => { if (run !== undefined) selectRun(run, group); });
}

const hasWay = (group, run) => ways.paths.some((way) => way.group === group && way.run === run);

function drawRuns() {
  const traces = [];
  const [x, y] = METRICS.includes('distance_inspected_m') ? ['search_time_s', 'distance_inspected_m'] : ['search_time_s', METRICS.at(-1)];
  const other = state.metric === x ? y : state.metric;
  for (const [number, rows] of chosen) {
    const { name, color, symbol } = lookOf(number);
    const some = thinned(rows.filter((row) => columns[x][row] !== null && columns[other][row] !== null), 1200);
    traces.push({
      mode: 'markers', name, x: some.map((row) => columns[x][row]), y: some.map((row) => columns[other][row]),
      customdata: some, text: some.map((row) => columns.run[row]),
      marker: {
        color, symbol, opacity: some.length > 300 ? 0.45 : 0.7,
        size: some.map((row) => (columns.run[row] === state.run ? 15 : 6)),
        line: { width: some.map((row) => (columns.run[row] === state.run ? 2.2 : hasWay(number, columns.run[row]) ? 1.4 : 0)), color: colour('--ink') },
      },
      hovertemplate: 'run %{text}<br>%{x:.4~g}, %{y:.4~g}<extra>%{fullData.name}</extra>',
    });
  }
  show('runs', traces, layoutOf(titles[x], titles[other]));
  onClick('runs', pick);
}

function pick(row) {
  if (typeof row === 'number') selectRun(columns.run[row], columns.group[row]);
}

function selectRun(run, group) {
  state.run = run;
  state.group = group ?? state.group ?? shownGroups()[0];
  drawRuns();
  drawRun();
}

function drawRun() {
  const rows = [];
  columns.run.forEach((run, row) => { if (run === state.run && chosen.has(columns.group[row])) rows.push(row); });
  byId('run').hidden = state.run === null;
  if (state.run === null) return;
  byId('run-number').value = state.run;
  const shown = [...METRICS, ...drawn.swept];
  const body = rows.slice(0, 60).map((row) => {
    const number = columns.group[row];
    return element('tr', {
      tabindex: '0', class: hasWay(number, state.run) ? 'has-way' : '', 'aria-selected': number === state.group,
      onclick: () => selectRun(state.run, number), onkeydown: (event) => { if (event.key === 'Enter') selectRun(state.run, number); },
    }, element('td', element('i', { style: `--own:var(${tintOf(number)})` }), groups[number]),
    shown.map((name) => element('td', columns[name][row] ?? '–')),
    element('td', columns.found[row] === null ? '–' : columns.found[row] ? 'found' : 'not found'));
  });
  byId('run-table').replaceChildren(element('table', element('thead', element('tr', element('th', 'manager'),
    shown.map((name) => element('th', titles[name] ?? name)), element('th', 'pipeline'))), element('tbody', body)));
  drawCommand();
  const way = ways.paths.find((each) => each.group === state.group && each.run === state.run);
  drawTimeOf(way);
  drawMapOf(way);
}

function drawCommand() {
  const canReplay = DATA.folders.length === 1 && Object.keys(made[0].manifest).length > 0 && columns.run[0] !== null;
  const command = `suave-des replay ${quoted(DATA.folders[0])} --run ${state.run} --managers ${quoted(drawn.managers[state.group] ?? '')} --open`;
  byId('run-command').replaceChildren(...(canReplay ? [element('span', 'watch it:'), element('code', command), element('button', {
    type: 'button', onclick: (event) => { navigator.clipboard?.writeText(command); event.target.textContent = 'copied'; },
  }, 'copy')] : []));
}
const quoted = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);

function drawTimeOf(way) {
  byId('run-legend').replaceChildren();
  if (!way) {
    show('run-time', [], {});
    const empty = byId('run-time').querySelector('.empty');
    const with_ = [...new Set(ways.paths.filter((each) => each.group === state.group).map((each) => each.run))];
    if (empty) empty.textContent = with_.length ? `this page has the paths and timelines of runs ${with_.join(', ')}; ${otherWays}, and the command above shows any run` : ways.note;
    return;
  }
  const modeColour = modeColours();
  const traces = [{
    mode: 'lines', x: way.t_s, y: way.visibility_m, name: 'visibility', fill: 'tozeroy', fillcolor: fade(lookOf(0).color, 0.08),
    line: { color: colour('--faint'), width: 1.2, dash: 'dot' }, hovertemplate: '%{y:.2f} m at %{x:.0f} s<extra>visibility</extra>',
  }];
  way.modes.forEach(([from, mode], place) => {
    const until = way.modes[place + 1]?.[0] ?? Infinity;
    const inside = way.t_s.map((t, n) => n).filter((n) => way.t_s[n] >= from && way.t_s[n] <= until + 1);
    traces.push({
      mode: 'lines', x: inside.map((n) => way.t_s[n]), y: inside.map((n) => way.altitude_m[n]), name: plain(mode || 'no mode'),
      line: { color: modeColour(mode), width: 2.6 }, hovertemplate: `%{y:.2f} m at %{x:.0f} s<extra>${plain(mode || 'no mode')}</extra>`,
    });
  });
  const top = Math.max(...way.altitude_m, ...way.visibility_m.map((each) => each ?? 0)) * 1.08;
  const failures = way.events.filter(([, event, detail]) => event === 'component_status' && detail.endsWith(' FALSE'));
  const seen = way.events.filter(([, event]) => event === 'pipeline_detected');
  const marks = [['adaptation', 'triangle-down', '--ink', way.adaptations], ['thruster fails', 'diamond', '--bad', failures],
    ['pipeline found', 'circle', '--good', seen]];
  for (const [name, symbol, tint, own] of marks) {
    traces.push({
      mode: 'markers', x: own.map((each) => each[0]), y: own.map(() => top), text: own.map((each) => plain(each.at(-1))),
      marker: { symbol, size: 10, color: colour(tint) }, hovertemplate: `%{x:.1f} s: ${name}, %{text}<extra></extra>`, name,
    });
  }
  show('run-time', traces, layoutOf('mission time (s)', 'altitude, visibility (m)', { yaxis: { rangemode: 'tozero' } }));
  const entry = (sign, tint, words) => element('span', element('b', { style: `color:${tint}` }, sign), words);
  const modes = [...new Set(way.modes.map(([, mode]) => mode))].filter((mode) => mode);
  byId('run-legend').replaceChildren(
    ...marks.filter(([, , , own]) => own.length).map(([name, symbol, tint]) => entry(SIGNS[symbol], colour(tint), name)),
    entry('┄', colour('--faint'), 'visibility'), element('span', 'altitude in'), ...modes.map((mode) => entry('━', modeColour(mode), mode)),
  );
}
const SIGNS = { 'triangle-down': '▼', diamond: '◆', circle: '●' };

function drawMapOf(way) {
  if (!way) {
    show('run-map', [], {});
    byId('run-map').replaceChildren();
    return;
  }
  const modeColour = modeColours();
  const colours = way.t_s.map((t) => modeColour(way.modes.findLast(([from]) => from <= t)?.[1] ?? ''));
  showMap('run-map', [{
    mode: 'lines+markers', x: way.x_m, y: way.y_m, name: 'way', text: way.t_s, line: { color: colour('--faint'), width: 1 },
    marker: { size: 4, color: colours }, hovertemplate: '%{text:.0f} s<extra></extra>',
  }, {
    mode: 'markers', x: way.x_m.slice(0, 1), y: way.y_m.slice(0, 1), name: 'start', marker: { size: 10, color: colour('--ink') }, hoverinfo: 'name',
  }]);
}

// Text and tables.

function tableOf(headings, rows) {
  return element('div.scroll', element('table', element('thead', element('tr',
    headings.map((each) => element('th', each)))), element('tbody', rows.map((cells) => {
    const number = groups.indexOf(cells[0]);
    return element('tr', cells.map((cell, place) => element('td',
      place === 0 && number >= 0 ? element('i', { style: `--own:var(${tintOf(number)})` }) : null, cell)));
  }))));
}

function writeText() {
  byId('title').textContent = DATA.title;
  byId('conclusion').textContent = results.conclusion;
  byId('notes').append(...[...results.notes, ...(ways.note ? [ways.note] : [])].map((each) => element('li', each)));
  byId('tables').append(element('h2', 'Tables'), ...results.sections.map((section, place) => element('details.block', { open: place < 2 ? '' : null },
    element('summary', section.title),
    section.tables.flatMap(([title, headings, rows]) => [title ? element('h3', title) : null, tableOf(headings, rows)]),
    section.below ? element('p', section.below) : null,
    section.conclusions.length ? element('ul', section.conclusions.map((each) => element('li', each))) : null)));
  byId('tables').append(element('details.block', element('summary', 'How it was compared'),
    element('ul', results.remarks.map((each) => element('li', each)))));
  byId('how').append(element('h2', 'How it was made'), ...made.map((each) => element('details.block', { open: '' },
    element('summary', each.folder),
    Object.keys(each.manifest).length ? null : element('p', 'There is no manifest.json that says how these were made.'),
    each.command ? element('div', element('p', 'To repeat it:'), element('pre', element('code', each.command))) : null,
    listed('manifest.json', Object.fromEntries(Object.entries(each.manifest).filter(([, value]) => typeof value === 'string'))),
    ...Object.entries(each.manifest).map(([key, value]) => (typeof value === 'string' ? null : listed(key.replaceAll('_', ' ').replace('sha256', 'SHA-256'), value))))));
  byId('made-by').textContent = `suave-des ${DATA.version}`;
}

const listed = (title, entries) => (Object.keys(entries).length ? element('details', element('summary', title), element('dl',
  Object.entries(entries).flatMap(([name, value]) => [element('dt', name), element('dd.mono', value)]))) : null);

function makeTools() {
  byId('managers').append(...groups.map((name, number) => element('button', {
    type: 'button', 'aria-pressed': 'true', style: `--own:var(${tintOf(number)})`, onclick: (event) => {
      const button = event.currentTarget;
      if (state.hidden.has(number)) state.hidden.delete(number);
      else if (shownGroups().length > 1) state.hidden.add(number);
      button.setAttribute('aria-pressed', !state.hidden.has(number));
      refresh();
    },
  }, element('i'), name)));
  const select = (place, entries, choose) => {
    place.append(...entries.map(([value, label]) => element('option', { value }, label)));
    place.onchange = () => { choose(place.value); refresh(); };
  };
  select(byId('metric'), METRICS.map((name) => [name, titles[name]]), (value) => { state.metric = value; });
  select(byId('found'), [], (value) => { state.found = value; });
  select(byId('reference'), groups.map((name, number) => [number, `difference to ${name}`]), (value) => { state.reference = Number(value); });
  for (const name of drawn.swept) {
    const values = [...new Set(columns[name])];
    if (values.length > 40) continue;
    const place = element('select', { 'aria-label': name });
    byId('sweeps').append(element('label', `${name} `, place));
    select(place, [['', 'all'], ...values.map((value) => [String(value), String(value)])], (value) => { state.sweep[name] = value; });
  }
  byId('run-number').onchange = (event) => selectRun(Number(event.target.value));
}

/** The run with a way that comes nearest to the last manager's median. */
function firstShown() {
  const group = groups.map((_, number) => number).findLast((number) => ways.paths.some((way) => way.group === number));
  if (group === undefined) return [0, columns.run[0]];
  const [metric] = METRICS;
  const times = known(rowsOf(group), metric).map((row) => [columns[metric][row], columns.run[row]]).sort((a, b) => a[0] - b[0]);
  const median = times[Math.floor(times.length / 2)]?.[0] ?? 0;
  const near = times.filter(([, run]) => hasWay(group, run)).sort((a, b) => Math.abs(a[0] - median) - Math.abs(b[0] - median));
  return [group, near[0]?.[1] ?? columns.run[0]];
}

async function start() {
  writeText();
  sayWhichWays();
  makeTools();
  startTheme(byId('theme'));
  [state.group, state.run] = firstShown();
  await startPlotly();
  await new Promise(requestAnimationFrame); // the text is read while the charts are drawn
  refresh();
  const alone = [...document.querySelectorAll('#charts > figure:not(.wide)')].filter((each) => !each.hidden);
  if (alone.length % 2) alone.at(-1).classList.add('alone');
  dispatchEvent(new Event('resize')); // the charts take their boxes' new width
  themeListeners.push(refresh);
  addEventListener('beforeprint', () => setTheme('light'));
  document.body.dataset.ready = 'true';
}
start();
