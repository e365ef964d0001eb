// What all pages share: elements without markup from data, the theme, and small numbers' helpers.

const DATA = JSON.parse(document.getElementById('data').textContent);

/** Make an element such as 'p.quiet', of attributes, children and lists of them; null is left out. Texts are always text, never markup. */
function element(name, ...parts) {
  const [tag, ...classes] = name.split('.');
  const made = document.createElement(tag);
  made.className = classes.join(' ');
  for (const part of parts.flat()) {
    if (Object.getPrototypeOf(part ?? '') === Object.prototype) setAttributes(made, part);
    else made.append(part ?? '');
  }
  return made;
}

function setAttributes(made, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) made[name] = value;
    else if (value !== null) made.setAttribute(name, value);
  }
}

const byId = (id) => document.getElementById(id);
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
const mix = (a, b, share) => a + (b - a) * share;

/** A stored choice; pages opened from a file may have no storage. */
function stored(name, value) {
  try {
    if (value !== undefined) localStorage.setItem(name, value);
    return localStorage.getItem(name);
  } catch {
    return null;
  }
}

const systemIsDark = matchMedia('(prefers-color-scheme: dark)');
const themeListeners = [];
function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  themeListeners.forEach((listener) => listener());
}
function startTheme(button) {
  const asked = new URLSearchParams(location.hash.slice(1)).get('theme');
  const chosen = () => stored('suave-des-theme') ?? (systemIsDark.matches ? 'dark' : 'light');
  setTheme(asked ?? chosen());
  systemIsDark.addEventListener('change', () => setTheme(chosen()));
  button.onclick = toggleTheme;
}
function toggleTheme() {
  const theme = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
  stored('suave-des-theme', theme);
  setTheme(theme);
}

/** The value of a colour of the theme. */
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** A function that gives the theme's colour of a mode. */
function modeColours() {
  const named = {
    fd_spiral_low: colour('--mode-low'), fd_spiral_medium: colour('--mode-medium'), fd_spiral_high: colour('--mode-high'),
    fd_follow_pipeline: colour('--mode-follow'), fd_unground: colour('--mode-idle'), '': colour('--mode-idle'),
  };
  return (mode) => named[mode] ?? colour('--mode-other');
}

/** Buttons of which one is pressed. */
function choice(parent, entries, chosen, onChoose) {
  const buttons = entries.map(([value, label, title]) => element('button', {
    type: 'button', title, 'aria-pressed': value === chosen, onclick: () => choose(value),
  }, label));
  function choose(value) {
    entries.forEach(([each], index) => buttons[index].setAttribute('aria-pressed', each === value));
    onChoose(value);
  }
  parent.append(...buttons);
  return choose;
}

/** Fit a canvas to its element at the screen's resolution; null while it is not shown. */
function fitted(canvas, height) {
  const ratio = Math.min(2, window.devicePixelRatio || 1);
  if (height) canvas.style.height = `${height}px`;
  const [width, tall] = [canvas.clientWidth, height || canvas.clientHeight];
  if (!width || !tall) return null;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(tall * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(tall * ratio);
  }
  const drawing = canvas.getContext('2d');
  drawing.setTransform(ratio, 0, 0, ratio, 0, 0);
  return { drawing, width, height: tall };
}
