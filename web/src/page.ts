// The page: a header and the sections, drawn from the data of a run. `show` may be called again with newer data.
import { camerasSection } from './cameras';
import { calibrationSection } from './calibration';
import { isMetric, pathLength, quantile, Run, unbrokenParts } from './data';
import { decimal, h, integer, metres, short } from './dom';
import { eventsSection } from './events';
import { findings } from './findings';
import { MapSection } from './map_section';
import { planSection } from './plan';
import { residualsSection } from './residuals';
import { settingsSection } from './settings';
import { currentTheme, setTheme, Theme } from './theme';
import { addTimeline } from './timeline';
import { timingSection } from './timing';
import { truthSection } from './truth';

interface Section {
  id: string; title: string; note: string;
  draw: (run: Run, body: HTMLElement) => (() => void)[] | void;
  when?: (run: Run) => boolean;
}

const fromElements = (make: (run: Run) => HTMLElement[]) => (run: Run, body: HTMLElement) => { body.append(...make(run)); };

function sections(map: MapSection): Section[] {
  return [
    { id: 'map', title: 'Map', draw: (run, body) => { body.append(map.show(run)); },
      note: 'Landmarks, the path of camera 0, and the rig. Pointing at a chart moves the marked pose.' },
    { id: 'plan', title: 'Path from above', draw: fromElements(planSection),
      note: 'Projected along the vertical, which is estimated from how the rig was held.' },
    { id: 'truth', title: 'Ground truth', draw: truthSection, when: (run) => run.truth !== null,
      note: 'Compared after the run; the estimator never sees it. The path of camera 0 is aligned to it, as by bslam eval.' },
    { id: 'timeline', title: 'Timeline', draw: (run, body) => [addTimeline(body, run)],
      note: 'What was tracked, and the state of every camera.' },
    { id: 'cameras', title: 'Cameras', draw: camerasSection,
      note: 'Inliers support the pose. In frames tracked directly no keypoints are extracted: matched are the landmarks that were aligned.' },
    { id: 'residuals', title: 'Residuals', draw: fromElements(residualsSection),
      note: 'Mean of observed minus projected position in each cell of the image, magnified equally. A good calibration leaves short ' +
            'arrows without order. Arrows toward or away from the centre: focal length or distortion. Whirls: rotation.' },
    { id: 'calibration', title: 'Calibration', draw: fromElements(calibrationSection),
      note: 'The map is adjusted once more with free calibration. Bold: more than three standard deviations.' },
    { id: 'time', title: 'Time', draw: timingSection, note: 'Per frame from images to pose, and per call of each stage.' },
    { id: 'events', title: 'Events', draw: fromElements(eventsSection), note: '' },
    { id: 'settings', title: 'Settings', draw: fromElements(settingsSection), note: 'With config.yaml the run can be repeated.' },
  ];
}

function themeSwitch(): HTMLElement {
  return h('fieldset', { class: 'choice theme' }, h('legend', { class: 'hidden' }, 'Colours of the page'),
    ...(['auto', 'light', 'dark'] as Theme[]).map((theme) => h('label', {},
      h('input', { type: 'radio', name: 'theme', checked: theme === currentTheme(), change: () => setTheme(theme) }), h('span', {}, theme))));
}

function figures(run: Run): HTMLElement {
  const s = run.summary, submap = run.submaps[0];
  const path = submap ? unbrokenParts(run, submap).reduce((sum, [from, to]) => sum + pathLength(submap.path.position.subarray(3 * from, 3 * to)), 0) : 0;
  const inliers = run.frames.cameras.length ? run.frames.time.map((_, i) => run.frames.cameras.reduce((sum, c) => sum + (c.inliers[i] || 0), 0)) : [];
  const observed = run.residuals.filter((r) => r.observations);
  const total = observed.reduce((sum, r) => sum + r.observations, 0);
  const rms = Math.sqrt(observed.reduce((sum, r) => sum + r.observations * r.rms_px ** 2, 0) / total);
  const entry = (name: string, value: string, note: string) => h('div', {}, h('dt', {}, name), h('dd', {}, value, h('small', {}, note)));
  return h('dl', { class: 'figures' },
    entry('frames tracked', integer(s.frames.tracked), `of ${integer(s.frames.input)}`),
    entry('path', short(path), isMetric(run) ? 'm' : 'map units'),
    entry('keyframes', integer(s.map.keyframes), ''),
    entry('landmarks', integer(s.map.landmarks), ''),
    entry('inliers', integer(quantile(inliers, 0.5)), '/ frame'),
    entry('reprojection', total ? decimal(rms, 2) : '–', 'px rms'),
    entry('time', decimal(s.time.frame_ms.median, 1), 'ms / frame'),
    run.truth && !run.truth.error && entry('position error', metres(run.truth.ate_m.rmse), 'rms'));
}

function header(run: Run, shown: Section[]): HTMLElement {
  const s = run.summary;
  const cameras = `camera${s.cameras_used.length === 1 ? '' : 's'} ${s.cameras_used.join(', ')}`;
  return h('header', {},
    h('div', { class: 'head' },
      h('div', {}, h('h1', {}, s.data), h('p', { class: 'soft' }, `bslam ${s.version}, ${cameras}, mode ${s.mode}, seed ${s.seed}`)), themeSwitch()),
    h('nav', { 'aria-label': 'Sections' }, h('ul', {}, ...shown.map((section) => h('li', {}, h('a', { href: `#${section.id}` }, section.title))))),
    figures(run),
    h('ul', { class: 'findings' }, ...findings(run).map((f) => h('li', { class: f.grade },
      h('b', {}, f.grade), h('a', { href: `#${f.target}` }, f.text)))));
}

export class Page {
  private readonly map = new MapSection();
  private removals: (() => void)[] = [];

  constructor(private readonly root: HTMLElement) {}

  show(run: Run) {
    for (const remove of this.removals) remove();
    this.removals = [];
    const focused = document.activeElement as HTMLElement | null, scrolled = scrollY;
    document.title = `${run.summary.data} - bslam run`;
    const shown = sections(this.map).filter((section) => section.when?.(run) ?? true);
    const bodies = shown.map(() => h('div', { class: 'body' }));
    this.root.replaceChildren(header(run, shown), h('main', {}, ...shown.map((section, i) =>
      h('section', { id: section.id, class: 'section', 'aria-labelledby': `${section.id}-title` },
        h('div', { class: 'margin' }, h('h2', { id: `${section.id}-title` }, section.title), section.note && h('p', {}, section.note)), bodies[i]))),
      this.footer(run));
    shown.forEach((section, i) => this.removals.push(...(section.draw(run, bodies[i]) ?? [])));  // charts need their width
    if (focused?.isConnected) focused.focus({ preventScroll: true });
    scrollTo(0, scrolled);
  }

  private footer(run: Run): HTMLElement {
    const licences = document.getElementById('licences') as HTMLTemplateElement;
    return h('footer', {}, h('p', {}, `Written by bslam ${run.summary.version}. This file is complete: it loads nothing from elsewhere.`),
      h('details', {}, h('summary', {}, 'Licences of the libraries in this page'), h('pre', {}, licences.content.textContent ?? '')));
  }
}
