// The section of the 3D map: the view, its controls, and the legend of its colours.
import { onTime, selectTime } from './cursor';
import { isMetric, lengthUnit, nearest, Run, timeRange } from './data';
import { decimal, h, plain, plural, seconds, short } from './dom';
import { LivePose } from './live_data';
import { morph } from './morph';
import { Drawing } from './section';
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

// Owns the canvas. The controls are made once, and again only if there is something else to choose from.
export class MapSection {
  private readonly canvas = h('canvas', {
    tabindex: 0, role: 'application', 'aria-describedby': 'map-keys',
    'aria-label': 'Map and path in 3D', click: (event) => this.select(event as PointerEvent) });
  private readonly view = MapView.create(this.canvas);
  private settings: ViewSettings = { submap: 0, colouring: 'height', points: true, keyframes: true, loops: true, truth: true,
                                     frusta: 'time', time: Infinity };
  private selected = Infinity;  // time of the marked pose; Infinity: the newest
  private submapChosen = false;
  private newest: { root: number; positions: number[]; rotation: number[] } | null = null;  // since the data of the run
  private shown = -1;
  private run!: Run;
  private choices = '';
  private readonly scale = h('div', { class: 'scale' });
  private readonly status = h('p', { class: 'status' });
  private readonly slider = h('input', { type: 'range', step: 'any', 'aria-label': 'Time of the marked pose',
                                         input: () => selectTime(Number(this.slider.value)) });
  private readonly ends = [h('span', {}), h('span', {})];
  private readonly controls = h('div', { class: 'controls' });

  constructor() {
    onTime((time) => this.setTime(time));
    onTheme(() => this.run && this.drawScale());
  }

  draw(run: Run, body: HTMLElement): Drawing {
    this.run = run;
    let drawn = false;
    const update = (newer: Run) => {
      this.run = newer;
      if (!drawn && newer.submaps.length) body.replaceChildren(this.elements());
      if (!newer.submaps.length) body.replaceChildren(h('p', {}, newer.live ? 'There is no map yet.' : 'The run has no map: no frame could be tracked.'));
      const sized = drawn;
      drawn = newer.submaps.length > 0;
      if (!drawn || !this.view) return;
      this.updateControls();
      if (sized) this.fill();
      else requestAnimationFrame(() => this.fill());  // the canvas gets its size before
    };
    update(run);
    return { update, remove: () => {} };
  }

  // Shows a pose that is newer than the data of the run.
  addNewest(pose: LivePose) {
    if (this.newest?.root !== pose.root) this.newest = null;
    this.newest ??= { root: pose.root, positions: [], rotation: pose.rotation };
    this.newest.positions.push(...pose.position);
    this.newest.rotation = pose.rotation;
    this.showNewest();
  }

  private showNewest() {
    const submap = this.run?.submaps[this.settings.submap];
    if (!this.view || this.shown < 0 || !submap || !this.newest || this.newest.root !== submap.root) return;
    if (this.selected !== Infinity) return;
    this.view.setNewest(this.newest.positions, this.newest.rotation);
    this.drawStatus('Newest pose', this.newest.positions.slice(-3));
  }

  private elements(): HTMLElement {
    if (!this.view) {
      return h('p', { class: 'notice' }, 'This browser cannot draw in 3D (WebGL 2 is missing or switched off).');
    }
    const newest = h('button', { type: 'button', click: () => this.setTime(Infinity) }, 'newest');
    return h('div', { class: 'map' }, this.controls, h('div', { class: 'view' }, this.canvas, this.buttons(), this.scale),
      h('div', { class: 'time' }, this.ends[0], this.slider, this.ends[1], newest), this.status,
      h('p', { class: 'hint', id: 'map-keys' },
        'Drag to turn, right button or two fingers to move, wheel to zoom. Keys: arrows turn, + and \u2212 zoom, Home and End ' +
        'look obliquely and from above. Click a keyframe to select its time.'));
  }

  private fill() {
    const follows = this.run.live && !this.submapChosen && this.newest;
    const current = follows ? this.run.submaps.findIndex((submap) => submap.root === this.newest!.root) : -1;
    if (current >= 0) this.settings.submap = current;
    if (this.settings.submap >= this.run.submaps.length) this.settings.submap = 0;
    const root = this.run.submaps[this.settings.submap].root;
    this.view!.show(this.run, this.settings, this.shown === root);
    this.shown = root;
    if (this.newest) this.newest.positions = this.newest.positions.slice(-3);  // the others are in the path now
    this.drawScale();
    this.setTime(this.selected);
  }

  private change(settings: Partial<ViewSettings>) {
    Object.assign(this.settings, settings);
    this.view!.update(this.settings);
    this.drawScale();
    this.setTime(this.selected);
  }

  private updateControls() {
    const [from, to] = timeRange(this.run);
    this.slider.min = String(from);
    this.slider.max = String(to);
    this.ends[0].textContent = seconds(from);
    this.ends[1].textContent = seconds(to);
    const { run } = this, truth = run.truth !== null && !run.truth.error, live = run.live === true;
    const choices = JSON.stringify([run.submaps.map((s) => [s.root, live || s.frames, s.loaded]), run.summary.loops.length > 0, truth]);
    if (choices !== this.choices) this.controls.replaceChildren(...this.controlsFor(run));
    this.choices = choices;
  }

  private controlsFor(run: Run): Node[] {
    const s = this.settings, summary = run.summary;
    const number = (root: number): number => run.submaps.filter((other) => other.root < root).length;  // as in bslam map info
    const submaps = run.submaps.length > 1 && h('label', { class: 'check' }, 'Submap ',
      h('select', { change: (event) => { s.submap = Number((event.target as HTMLSelectElement).value); this.submapChosen = true; this.fill(); } },
        ...run.submaps.map((submap, i) => h('option', { value: i, selected: i === s.submap },
          `${number(submap.root)}${run.live ? '' : `: ${plural(submap.frames, 'frame')}`}${submap.loaded ? ', loaded' : ''}`))));
    return [
      submaps,
      radios('Points by', 'colouring', [['height', 'height'], ['age', 'age'], ['plain', 'none']], s.colouring,
        (colouring) => this.change({ colouring })),
      radios('Frusta', 'frusta', [['time', 'one pose'], ['keyframes', 'keyframes'], ['none', 'none']], s.frusta,
        (frusta) => this.change({ frusta })),
      checkbox('points', s.points, (points) => this.change({ points })),
      checkbox('keyframes', s.keyframes, (keyframes) => this.change({ keyframes })),
      summary.loops.length > 0 && checkbox('loops', s.loops, (loops) => this.change({ loops })),
      run.truth && !run.truth.error && checkbox('ground truth', s.truth, (truth) => this.change({ truth })),
    ].filter((part) => part !== false && part !== null);
  }

  private buttons() {
    const view = this.view!;
    const button = (text: string, click: () => void, label?: string) => h('button', { type: 'button', 'aria-label': label, click }, text);
    return h('div', { class: 'buttons' },
      button('oblique', () => view.oblique()), button('from above', () => view.fromAbove()),
      button('+', () => view.zoom(1 / 1.3), 'zoom in (+)'), button('\u2212', () => view.zoom(1.3), 'zoom out (\u2212)'));
  }

  // Marks the pose at a time; that at the end or after it is the newest one.
  private setTime(time: number) {
    if (!this.view || !this.run?.submaps.length || this.shown < 0) return;
    const end = timeRange(this.run)[1];
    this.selected = time >= end ? Infinity : time;
    this.settings.time = Math.min(time, end);
    this.slider.value = String(this.settings.time);
    const { path } = this.run.submaps[this.settings.submap];
    if (this.selected === Infinity && this.newest && this.newest.root === this.shown) return this.showNewest();
    this.view.setTime(this.settings.time);
    if (!path.time.length) return;
    const i = nearest(path.time, this.settings.time);
    this.drawStatus(`Pose at ${seconds(path.time[i])}`, path.position.subarray(3 * i, 3 * i + 3));
  }

  private drawStatus(what: string, position: ArrayLike<number>) {
    const p = [0, 1, 2].map((k) => decimal(position[k], 3)).join(', ');
    morph(this.status, [h('b', {}, what), ` camera 0 at (${p}) ${lengthUnit(this.run)}`]);
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
