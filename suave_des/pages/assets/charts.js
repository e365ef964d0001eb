// Charts drawn by Plotly in the page's own style.

/** Expand the library and run it; it comes compressed, as it is five times as long. */
async function startPlotly() {
  const packed = Uint8Array.from(atob(byId('library').textContent), (each) => each.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  const address = URL.createObjectURL(new Blob([await new Response(stream).text()], { type: 'text/javascript' }));
  await new Promise((resolve, reject) => {
    document.head.append(Object.assign(document.createElement('script'), { src: address, onload: resolve, onerror: reject }));
  });
  URL.revokeObjectURL(address);
}

const DASHES = ['solid', 'dash', 'dot', 'dashdot', 'longdash'];
const SYMBOLS = ['circle', 'square', 'diamond', 'triangle-up', 'cross', 'x'];
const CONFIG = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ['select2d', 'lasso2d', 'autoScale2d'] };
const { groups, looks } = DATA.results.drawn;
const tintOf = (number) => `--m${looks[number] % 6}`;

/** The name and the look of a manager, which is the one that it has in figures. */
const lookOf = (number) => ({
  name: plain(groups[number]), color: colour(tintOf(number)),
  dash: DASHES[looks[number] % DASHES.length], symbol: SYMBOLS[looks[number] % SYMBOLS.length],
});

/** Names may contain what Plotly would take for markup. */
const plain = (text) => String(text).replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;').replace(/\$/g, '&#36;');

function layoutOf(x, y, more = {}) {
  const axis = (title) => ({
    title: { text: title, font: { size: 12, color: colour('--soft') }, standoff: 8 }, gridcolor: colour('--line'),
    zerolinecolor: colour('--line'), linecolor: colour('--faint'), tickfont: { size: 11 },
  });
  const { xaxis, yaxis, ...rest } = more;
  return {
    paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)', margin: { l: 56, r: 16, t: 30, b: 46 },
    modebar: { bgcolor: 'rgba(0,0,0,0)', color: colour('--faint'), activecolor: colour('--accent') },
    font: { family: colour('--font'), color: colour('--ink'), size: 12 }, showlegend: false, hovermode: 'closest',
    hoverlabel: { bgcolor: colour('--card'), bordercolor: colour('--line'), font: { color: colour('--ink') }, namelength: -1 },
    xaxis: { ...axis(x), ...xaxis }, yaxis: { ...axis(y), ...yaxis }, ...rest,
  };
}

function show(id, traces, layout) {
  const place = byId(id);
  if (!traces.length) {
    if (place.classList.contains('js-plotly-plot')) Plotly.purge(place);
    place.replaceChildren(element('div.empty', 'nothing to show with this choice'));
    return;
  }
  if (place.firstChild?.className === 'empty') place.replaceChildren();
  Plotly.react(place, traces, layout, CONFIG);
}

/** Do something with each point of a chart that is clicked on, in place of what was done before. */
function onClick(id, action) {
  byId(id).removeAllListeners?.('plotly_click');
  byId(id).on?.('plotly_click', (event) => action(event.points[0].customdata));
}

/** Share of values at or below each value, with few points for many values. */
function distribution(values) {
  const sorted = Float64Array.from(values).sort();
  const count = Math.min(sorted.length, 600);
  const [x, y] = [[], []];
  for (let n = 1; n <= count; n++) {
    const place = Math.ceil((n * sorted.length) / count);
    x.push(sorted[place - 1]);
    y.push(place / sorted.length);
  }
  return { x: [sorted[0], ...x], y: [0, ...y] };
}

const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;

/** Half the 95% interval of a mean, by Student's t (its expansion in 1/n, right to 1% from 4 values on); null for fewer. */
function halfInterval(values) {
  const free = values.length - 1;
  if (free < 3) return null;
  const [centre, z] = [mean(values), 1.959964];
  const t = z + (z ** 3 + z) / (4 * free) + (5 * z ** 5 + 16 * z ** 3 + 3 * z) / (96 * free ** 2)
    + (3 * z ** 7 + 19 * z ** 5 + 17 * z ** 3 - 15 * z) / (384 * free ** 3);
  const variance = values.reduce((sum, value) => sum + (value - centre) ** 2, 0) / free;
  return t * Math.sqrt(variance / values.length);
}

/** At most so many entries, evenly chosen. */
const thinned = (entries, most) => (entries.length <= most ? entries
  : Array.from({ length: most }, (_, n) => entries[Math.floor((n * entries.length) / most)]));
