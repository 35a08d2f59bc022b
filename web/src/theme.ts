// Light and dark. The colours are custom properties of style.css; canvases read them whenever they draw.

const listeners = new Set<() => void>();
const dark = matchMedia('(prefers-color-scheme: dark)');
let choice: 'light' | 'dark' | 'auto' = 'auto';
let printing = false;

export type Theme = typeof choice;

function apply() {
  const theme = printing ? 'light' : choice === 'auto' ? (dark.matches ? 'dark' : 'light') : choice;
  document.documentElement.dataset.theme = theme;
  for (const redraw of listeners) redraw();
}

export function setTheme(theme: Theme) {
  choice = theme;
  try {
    localStorage.setItem('bslam-theme', theme);
  } catch { /* storage is not available for files in some browsers */ }
  apply();
}

export const currentTheme = () => choice;

export function startThemes() {
  try {
    const stored = localStorage.getItem('bslam-theme');
    if (stored === 'light' || stored === 'dark') choice = stored;
  } catch { /* as above */ }
  dark.addEventListener('change', apply);
  addEventListener('beforeprint', () => { printing = true; apply(); });
  addEventListener('afterprint', () => { printing = false; apply(); });
  apply();
}

// Calls `redraw` after every change of the colours, until the returned function is called.
export function onTheme(redraw: () => void): () => void {
  listeners.add(redraw);
  return () => listeners.delete(redraw);
}

export const isDark = () => document.documentElement.dataset.theme === 'dark';

export function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

export const kCameraColours = 6;
export const cameraColour = (camera: number) => `camera-${camera % kCameraColours}`;

// The colour scale of heights and ages: viridis without the end that vanishes on the ground of the page.
const kViridis = [
  [68, 1, 84], [72, 40, 120], [62, 73, 137], [49, 104, 142], [38, 130, 142],
  [31, 158, 137], [53, 183, 121], [110, 206, 88], [181, 222, 43], [253, 231, 37],
];

export function scaleColour(share: number): [number, number, number] {
  const [low, high] = isDark() ? [0.25, 1] : [0, 0.82];
  const position = (low + (high - low) * Math.min(1, Math.max(0, share))) * (kViridis.length - 1);
  const below = Math.min(Math.floor(position), kViridis.length - 2), part = position - below;
  const mix = (i: number) => kViridis[below][i] + part * (kViridis[below + 1][i] - kViridis[below][i]);
  return [mix(0) / 255, mix(1) / 255, mix(2) / 255];
}
