// The MAPE-K panel: what the manager knows, what followed by which rule, and what it decided.

const HELD_S = 9; // after this the panel shows what happened last as something past
const STATUS = /^(fg_status|o_status|o_updatable|fd_realisability|c_status|fd_error_log)\((.*)\)$/;

function makePanel(play) {
  const phases = Object.fromEntries(['Monitor', 'Analyze', 'Plan', 'Execute', 'Knowledge'].map((title) => {
    const time = element('time');
    const body = element('div');
    const name = title.toLowerCase();
    return [name, { box: element(`section.phase.${name}`, element('h3', title, time), body), body, time }];
  }));
  const { note } = play.mission.cycles;
  const box = element('aside.mind', { 'aria-label': `MAPE-K of ${play.manager}` },
    Object.values(phases).map((each) => each.box));
  if (note) box.append(element('section.phase', element('p.note', note)));
  const gauges = new Map();
  const shown = {};

  /** Show a part only when it has changed, so that what a reader has opened stays open. */
  function once(name, key, make) {
    if (shown[name] === key) return;
    shown[name] = key;
    phases[name].body.replaceChildren(...[make()].flat());
  }

  function update(moment) {
    const { cycles } = play.mission.cycles;
    const place = lastAt(cycles, moment.t, (each) => each.t_s);
    const cycle = cycles[place];
    const event = play.happenings.slice(0, place + 1).findLast((each) => each);
    showMonitor(moment, cycle);
    if (!cycles.length) showWithout(moment);
    else showReasoning(moment, cycle, event);
    showExecute(moment);
    const age = (t = -Infinity) => moment.t - t;
    const done = play.requests[lastAt(play.requests, moment.t, (each) => each.t)];
    const [reported] = play.mission.thrusters.findLast(([t]) => t <= moment.t + 1e-6) ?? [];
    phases.monitor.box.classList.toggle('active', age(cycle?.t_s) < 1 || age(reported) < 2);
    phases.analyze.box.classList.toggle('active', age(event?.t_s) < 2.5 && event.inferred >= 0);
    phases.plan.box.classList.toggle('active', age(event?.t_s) < 3);
    phases.execute.box.classList.toggle('active', age(done?.t) < 2);
  }

  function showMonitor(moment, cycle) {
    const measured = { ...cycle?.measured };
    for (const [name, value] of Object.entries(moment.further)) if (typeof value === 'number') measured[name] = value;
    if (moment.visibility !== null) measured.water_visibility = moment.visibility;
    const names = Object.keys(measured);
    const lamps = moment.thrusters.map((works) => (works === false ? 0 : 1)).join('');
    once('monitor', names.join() + lamps, () => {
      gauges.clear();
      const rows = names.map((name) => {
        const isVisibility = name === 'water_visibility';
        const most = isVisibility ? play.top : Math.max(1, measured[name]);
        const ticks = isVisibility ? DATA.scenario.thresholds_m : [];
        const gauge = { fill: element('div.fill'), text: element('b'), most, isVisibility };
        gauges.set(name, gauge);
        return element('div.gauge', element('span', name.replaceAll('_', ' ')),
          element('div.rail', gauge.fill, ticks.map((tick) => element('span.tick', {
            style: `left:${(100 * tick) / most}%`, title: `${tick} m`,
          }))), gauge.text);
      });
      const failed = moment.thrusters.flatMap((works, number) => (works === false ? [number + 1] : []));
      rows.push(element('p', { class: failed.length ? '' : 'quiet' }, failed.length
        ? `thruster ${failed.join(', ')} reported as failed` : 'all thrusters reported as working'));
      return rows;
    });
    for (const [name, gauge] of gauges) {
      gauge.fill.style.width = `${clamp((100 * measured[name]) / gauge.most, 0, 100)}%`;
      gauge.text.textContent = `${measured[name].toFixed(2)}${gauge.isVisibility ? ' m' : ''}`;
    }
    phases.monitor.time.textContent = cycle ? `cycle at ${cycle.t_s.toFixed(1)} s` : '';
  }

  function showReasoning(moment, cycle, event) {
    if (!cycle) {
      for (const name of ['analyze', 'plan', 'knowledge']) once(name, 'none', () => element('p.quiet', 'no cycle yet'));
      return;
    }
    const show = event ?? cycle;
    const isHeld = moment.t - show.t_s > HELD_S;
    for (const name of ['analyze', 'plan']) {
      phases[name].body.classList.toggle('held', isHeld);
      phases[name].time.textContent = event ? `at ${show.t_s.toFixed(1)} s` : '';
    }
    const inferred = play.mission.cycles.inferences[show.inferred];
    once('analyze', show.t_s, () => (inferred
      ? inferred.facts.toSorted((a, b) => weight(b) - weight(a)).map((fact) => showFact(fact, inferred.t_s, show.t_s))
      : element('p.quiet', 'no rule adds anything: all objectives are met')));
    once('plan', show.t_s, () => (show.decided.length
      ? show.decided.toSorted((a, b) => stays(a) - stays(b)).map(showDecision) : element('p.quiet', 'nothing calls for adaptation')));
    const rows = Object.entries(cycle.objectives).map(([name, status]) => [name, cycle.groundings[name] ?? 'not grounded', status]);
    const parts = Object.entries(cycle.components);
    once('knowledge', JSON.stringify([rows, parts]), () => element('div.known',
      rows.flatMap(([name, design, status]) => [element('span', name), element('span', design),
        element('span', { class: status ? 'error' : 'quiet' }, status ?? 'met')]),
      parts.flatMap(([name, status]) => [element('span', name),
        element('span', { class: status === 'FALSE' ? 'error' : '' }, status), element('span')])));
  }

  const weight = (fact) => (/^(o_status|fg_status)/.test(fact.fact) ? 2 : STATUS.test(fact.fact) ? 1 : 0);

  function showFact(fact, tracedAt, t) {
    const rule = play.mission.cycles.rules[fact.rule];
    const by = fact.rule
      ? [element('div.by', 'by rule ', element('b', fact.rule)),
        element('div.bindings', fact.bindings.map(([name, value]) => element('span', `?${name} = ${value}`)))]
      : [element('div.by', 'by the schema of the ontology')];
    const because = element('details', element('summary', rule ? 'rule and facts' : 'facts'),
      rule ? element('div.rule', rule) : null, fact.because.map(showStep),
      tracedAt !== t ? element('p', `numbers as at ${tracedAt.toFixed(1)} s, the first such cycle`) : null);
    return element('div.fact', element('div.says', wordsOf(fact.fact)), by, because);
  }

  function showStep(step) {
    const how = { rule: `by rule ${step.rule}`, state: 'known', ontology: 'in the ontology', axioms: 'by the schema' }[step.source];
    return element('div.because', element('code', step.fact), ` ${how}`, step.because.map(showStep));
  }

  function wordsOf(fact) {
    const found = STATUS.exec(fact);
    if (!found) return [element('code', fact)];
    const [subject, value] = found[2].split(', ');
    const objective = `objective of ${subject.replace(/^o_/, '')} is `;
    const [words, answer = value] = {
      fg_status: [`grounding of ${subject.replace(/^fg_/, 'fd_')} is `],
      o_status: [objective],
      o_updatable: [objective, value === 'true' ? 'updatable' : 'not updatable'],
      fd_realisability: [`${subject} is `, value === 'false' ? 'not realisable' : 'realisable'],
      c_status: [`${subject} is `],
      fd_error_log: [`${subject} has an error for `],
    }[found[1]];
    return [words, element('em', answer)];
  }

  const stays = (decided) => Number(decided.chosen === decided.before);

  function showDecision(decided) {
    const answer = decided.chosen === null ? 'no design is left' : stays(decided) ? `${decided.chosen} stays` : null;
    return element('div.function',
      element('p', `${decided.function}: `, answer ?? decided.reason.split(': ')[0]),
      element('ul.designs', decided.designs.map((design) => element('li', {
        class: { chosen: 'chosen', 'left out': 'out' }[design.verdict] ?? '',
      }, element('span.name', design.name), element('span.why',
        design.verdict === 'left out' ? `left out: ${design.reason}` : `performance ${design.performance}${design.verdict === 'chosen' ? ', chosen' : ''}`)))));
  }

  function showWithout(moment) {
    const own = play.mission.events.filter(([, source]) => source === play.manager);
    const until = lastAt(own, moment.t, ([t]) => t);
    once('analyze', `own${until}`, () => (own.length
      ? own.slice(Math.max(0, until - (own[until]?.[2] === 'tick' ? 0 : 3)), until + 1).map(showOwn)
      : element('p.quiet', `${play.manager} records no knowledge: its decisions are made in code`)));
    once('plan', 'own', () => element('p.quiet', 'see what it requests, below'));
    once('knowledge', 'own', () => element('p.quiet', 'no knowledge base'));
  }

  function showOwn([t, , name, detail]) {
    const words = `${t.toFixed(1)} s  ${name.replaceAll('_', ' ')}`;
    return name === 'tick' ? element('div', element('p.tick-time', words), ticked(detail)) : element('p', `${words}: ${detail}`);
  }

  /** A tick as a tree: its parts are separated by semicolons, and have those below them in brackets. */
  function ticked(text) {
    const parts = [''];
    let depth = 0;
    for (const letter of text) {
      depth += letter === '(' ? 1 : letter === ')' ? -1 : 0;
      if (letter === ';' && depth === 0) parts.push('');
      else parts[parts.length - 1] += letter;
    }
    return element('ul.ticked', parts.map((part) => {
      const [, head, below] = /^(.*?) \((.*)\)$/.exec(part.trim()) ?? [null, part.trim(), null];
      return element('li', { class: / failure$/.test(head) ? 'failure' : '' }, head, below === null ? null : ticked(below));
    }));
  }

  function showExecute(moment) {
    const until = lastAt(play.requests, moment.t, (each) => each.t);
    const recent = play.requests.slice(Math.max(0, until - 2), until + 1).reverse();
    const key = recent.map((each) => [each.t, each.set <= moment.t]).join();
    once('execute', key, () => (recent.length ? recent.map(({ t, change, set }) => element('p', element('code', change), ' ',
      element('span.quiet', `${t.toFixed(1)} s, ${set <= moment.t ? `in effect ${set.toFixed(1)} s` : 'under way'}`)))
      : element('p.quiet', 'no mode requested yet')));
  }

  return { box, update };
}

/** Index of the last entry at or before a time, -1 if there is none. */
const lastAt = (entries, t, timeOf) => entries.findLastIndex((each) => timeOf(each) <= t + 1e-6);
