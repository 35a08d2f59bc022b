// The section of the 3D map: the view, its controls, and the legend of its colours.
import { onTime, selectTime } from './cursor';
import { isMetric, lengthUnit, Run, timeRange } from './data';
import { decimal, h, plain, plural, seconds, short } from './dom';
import { cameraColour, onTheme, scaleColour } from './theme';
import { MapView, ViewSettings } from './view3d';

function radios<T extends string>(legend: string, name: string, values: [T, string][], chosen: T, change: (value: T) => void) {
  return h('fieldset', { class: 'choice' }, h('legend', {}, legend),
    ...values.map(([value, text]) => h('label', {},
      h('input', { type: 'radio', name, value, checked: value === chosen, change: () => change(value) }), h('span', {}, text))));
}

function checkbox(text: string, checked: boolean, change: (value: boolean) => void) {
  const input = h('input', { type: 'checkbox', checked, change: () => change(input.checked) });
  return h('label', { class: 'check' }, input, text);
}

// Owns the canvas, so that the point of view remains when the data of a run are shown again.
export class MapSection {
  private readonly canvas = h('canvas', {
    tabindex: 0, role: 'application', 'aria-describedby': 'map-keys',
    'aria-label': 'Map and path in 3D', click: (event) => this.select(event as PointerEvent) });
  private readonly view = MapView.create(this.canvas);
  private settings: ViewSettings = { submap: 0, colouring: 'height', points: true, keyframes: true, loops: true, truth: true,
                                     frusta: 'time', time: Infinity };
  private shown = -1;
  private run!: Run;
  private readonly scale = h('div', { class: 'scale' });
  private readonly status = h('p', { class: 'status', role: 'status' });
  private slider = h('input', { type: 'range' });

  constructor() {
    onTime((time) => this.setTime(time));
    onTheme(() => this.run && this.drawScale());
  }

  show(run: Run): HTMLElement {
    this.run = run;
    if (!run.submaps.length) return h('p', {}, 'The run has no map: no frame could be tracked.');
    if (this.settings.submap >= run.submaps.length) this.settings.submap = 0;
    if (!this.view) {
      return h('p', { class: 'notice' }, 'This browser cannot draw in 3D (WebGL 2 is missing or switched off).');
    }
    const element = h('div', { class: 'map' }, this.controls(run), h('div', { class: 'view' }, this.canvas, this.buttons(), this.scale),
      this.timeControl(run), this.status,
      h('p', { class: 'hint', id: 'map-keys' },
        'Drag to turn, right button or two fingers to move, wheel to zoom. Keys: arrows turn, + and \u2212 zoom, Home and End ' +
        'look obliquely and from above. Click a keyframe to select its time.'));
    requestAnimationFrame(() => this.fill());
    return element;
  }

  private fill() {
    this.view!.show(this.run, this.settings, this.shown === this.settings.submap);
    this.shown = this.settings.submap;
    this.drawScale();
    this.setTime(Math.min(this.settings.time, timeRange(this.run)[1]));
  }

  private change(settings: Partial<ViewSettings>) {
    Object.assign(this.settings, settings);
    this.view!.update(this.settings);
    this.drawScale();
  }

  private controls(run: Run) {
    const s = this.settings, summary = run.summary;
    const submaps = run.submaps.length > 1 && h('label', { class: 'check' }, 'Submap ',
      h('select', { change: (event) => { s.submap = Number((event.target as HTMLSelectElement).value); this.fill(); } },
        ...run.submaps.map((submap, i) => h('option', { value: i, selected: i === s.submap },
          `${i + 1}: ${plural(submap.frames, 'frame')}${submap.loaded ? ', loaded' : ''}`))));
    return h('div', { class: 'controls' },
      submaps,
      radios('Points by', 'colouring', [['height', 'height'], ['age', 'age'], ['plain', 'none']], s.colouring,
        (colouring) => this.change({ colouring })),
      radios('Frusta', 'frusta', [['time', 'one pose'], ['keyframes', 'keyframes'], ['none', 'none']], s.frusta,
        (frusta) => this.change({ frusta })),
      checkbox('points', s.points, (points) => this.change({ points })),
      checkbox('keyframes', s.keyframes, (keyframes) => this.change({ keyframes })),
      summary.loops.length > 0 && checkbox('loops', s.loops, (loops) => this.change({ loops })),
      run.truth && !run.truth.error && checkbox('ground truth', s.truth, (truth) => this.change({ truth })));
  }

  private buttons() {
    const view = this.view!;
    const button = (text: string, click: () => void, label?: string) => h('button', { type: 'button', 'aria-label': label, click }, text);
    return h('div', { class: 'buttons' },
      button('oblique', () => view.oblique()), button('from above', () => view.fromAbove()),
      button('+', () => view.zoom(1 / 1.3), 'zoom in (+)'), button('\u2212', () => view.zoom(1.3), 'zoom out (\u2212)'));
  }

  private timeControl(run: Run) {
    const [from, to] = timeRange(run);
    this.slider = h('input', { type: 'range', min: from, max: to, step: 'any', 'aria-label': 'Time of the marked pose',
                               input: () => selectTime(Number(this.slider.value)) });
    this.slider.value = String(Math.min(this.settings.time, to));
    return h('div', { class: 'time' }, h('span', {}, seconds(from)), this.slider, h('span', {}, seconds(to)));
  }

  private setTime(time: number) {
    if (!this.view || !this.run?.submaps.length) return;
    this.slider.value = String(time);
    this.settings.time = time;
    this.view.setTime(time);
    const { path } = this.run.submaps[this.settings.submap];
    if (!path.time.length) return;
    let i = 0;
    path.time.forEach((t, k) => { if (Math.abs(t - time) < Math.abs(path.time[i] - time)) i = k; });
    const p = [0, 1, 2].map((k) => decimal(path.position[3 * i + k], 3)).join(', ');
    this.status.replaceChildren(h('b', {}, `Pose at ${seconds(path.time[i])}`), ` camera 0 at (${p}) ${lengthUnit(this.run)}`);
  }

  private select(event: PointerEvent) {
    const keyframe = this.view?.pick(event.offsetX, event.offsetY) ?? -1;
    if (keyframe >= 0) selectTime(this.run.submaps[this.settings.submap].keyframes.time[keyframe]);
  }

  private drawScale() {
    const { from, to } = this.view!.colourRange(), age = this.settings.colouring === 'age';
    const unit = age ? 's' : isMetric(this.run) ? 'm' : '';
    const swatches = Array.from({ length: 24 }, (_, i) => {
      const [r, g, b] = scaleColour(i / 23).map((v) => Math.round(255 * v));
      return h('span', { style: `background: rgb(${r} ${g} ${b})` });
    });
    const cameras = this.settings.frusta === 'none' ? [] : this.run.rig.map((camera, c) => h('li', {},
      h('span', { class: 'swatch', style: `--swatch: var(--${cameraColour(c)})` }), camera.name));
    const entry = (name: string, text: string) => h('li', {}, h('span', { class: 'swatch', style: `--swatch: var(--${name})` }), text);
    this.scale.replaceChildren(
      h('ul', { class: 'legend' }, entry('path', 'path'),
        this.run.truth && !this.run.truth.error && this.settings.truth && entry('truth', 'ground truth'),
        this.run.summary.loops.length > 0 && this.settings.loops && entry('loop', 'loop closure'), ...cameras),
      ...(this.settings.colouring === 'plain' ? [] : [h('div', { class: 'ramp' },
        h('span', {}, `${age ? 'created' : 'height'} ${short(from)}`), h('span', { class: 'swatches' }, ...swatches),
        h('span', {}, `${short(to)} ${unit}`))]),
      h('span', { class: 'grid-note' }, `grid ${plain(this.view!.gridSpacing)} ${lengthUnit(this.run)}`));
  }
}
