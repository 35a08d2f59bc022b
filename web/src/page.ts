// The page: a header and the sections, drawn from the data of a run.
import { camerasSection } from './cameras';
import { calibrationSection } from './calibration';
import { isMetric, pathLength, quantile, Run, unbrokenParts } from './data';
import { decimal, h, integer, metres, short } from './dom';
import { eventsSection } from './events';
import { findings } from './findings';
import { MapSection } from './map_section';
import { morph } from './morph';
import { planSection } from './plan';
import { residualsSection } from './residuals';
import { Draw, Drawing, fromElements, remade } from './section';
import { settingsSection } from './settings';
import { currentTheme, setTheme, Theme } from './theme';
import { timelineSection } from './timeline';
import { timingSection } from './timing';
import { truthSection } from './truth';

interface Section {
  id: string; title: string; note: string;
  draw: Draw;
  when?: (run: Run) => boolean;
}

// A section above the others, which is not drawn from the data of a run.
export interface Lead { id: string; title: string; body: HTMLElement }

function sections(map: MapSection): Section[] {
  return [
    { id: 'map', title: 'Map', draw: (run, body) => map.draw(run, body),
      note: 'Landmarks, the path of camera 0, and the rig. Pointing at a chart moves the marked pose.' },
    { id: 'plan', title: 'Path from above', draw: fromElements(planSection),
      note: 'Projected along the vertical, which is estimated from how the rig was held.' },
    { id: 'truth', title: 'Ground truth', draw: truthSection, when: (run) => run.truth !== null,
      note: 'Compared after the run; the estimator never sees it. The path of camera 0 is aligned to it, as by bslam eval.' },
    { id: 'timeline', title: 'Timeline', draw: timelineSection,
      note: 'What was tracked, and the state of every camera.' },
    { id: 'cameras', title: 'Cameras', draw: camerasSection,
      note: 'Inliers support the pose. In frames tracked directly no keypoints are extracted: matched are the landmarks that were aligned.' },
    { id: 'residuals', title: 'Residuals', when: (run) => !run.live,
      draw: remade(residualsSection, (run) => run.residuals.map((r) => [r.observations, r.rms_px])),
      note: 'Mean of observed minus projected position in each cell of the image, magnified equally. A good calibration leaves short ' +
            'arrows without order. Arrows toward or away from the centre: focal length or distortion. Whirls: rotation.' },
    { id: 'calibration', title: 'Calibration', when: (run) => !run.live, draw: fromElements(calibrationSection),
      note: 'The map is adjusted once more with free calibration. Bold: more than three standard deviations.' },
    { id: 'time', title: 'Time', draw: timingSection, note: 'Per frame from images to pose, and per call of each stage.' },
    { id: 'events', title: 'Events', draw: fromElements(eventsSection), note: '' },
    { id: 'warnings', title: 'Warnings', when: (run) => run.summary.warnings.length > 0,
      draw: fromElements((run) => [h('ul', {}, ...run.summary.warnings.map((text) => h('li', {}, text)))]), note: 'As printed by the run; docs/messages.md explains them.' },
    { id: 'settings', title: 'Settings', draw: remade(settingsSection, (run) => [run.command, run.settings]), note: 'With config.yaml the run can be repeated.' },
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
    !run.live && entry('reprojection', total ? decimal(rms, 2) : '–', 'px rms'),
    entry('time', decimal(s.time.frame_ms.median, 1), 'ms / frame'),
    run.truth && !run.truth.error && entry('position error', metres(run.truth.ate_m.rmse), 'rms'));
}

function findingItems(run: Run): HTMLElement[] {
  return findings(run).map((f) => h('li', { class: f.grade }, h('b', {}, f.grade), h('a', { href: `#${f.target}` }, f.text)));
}

function subtitle(run: Run): string {
  const s = run.summary;
  return `bslam ${s.version}, camera${s.cameras_used.length === 1 ? '' : 's'} ${s.cameras_used.join(', ')}, mode ${s.mode}, seed ${s.seed}`;
}

function footer(version: string, live: boolean): HTMLElement {
  const licences = document.getElementById('licences') as HTMLTemplateElement;
  return h('footer', {}, h('p', {}, live ? `Shown by bslam ${version}.` : `Written by bslam ${version}. This file is complete: it loads nothing from elsewhere.`),
    h('details', {}, h('summary', {}, 'Licences of the libraries in this page'), h('pre', {}, licences.content.textContent ?? '')));
}

// Draws the run when `show` is called first, and changes what differs when it is called again: the point of view, the focus
// and selected ranges remain.
export class Page {
  readonly map = new MapSection();
  private readonly sections = sections(this.map);
  private readonly drawn = new Map<string, { element: HTMLElement; drawing: Drawing }>();
  private readonly title = h('h1', {});
  private readonly subtitle = h('p', { class: 'soft' });
  private readonly nav = h('ul', {});
  private readonly figures = h('div', {});
  private readonly findings = h('ul', { class: 'findings' });
  private readonly main = h('main', {});
  private version = '';

  constructor(private readonly root: HTMLElement, private readonly lead: Lead | null = null) {}

  // The page without data.
  begin(name: string) {
    document.title = `${name} - bslam run`;
    this.title.textContent = name;
    this.root.replaceChildren(h('header', {},
      h('div', { class: 'head' }, h('div', {}, this.title, this.subtitle), themeSwitch()),
      h('nav', { 'aria-label': 'Sections' }, this.nav), this.figures, this.findings), this.main);
    if (this.lead) {
      this.main.append(h('section', { id: this.lead.id, class: 'lead', 'aria-label': this.lead.title }, this.lead.body));
    }
  }

  show(run: Run) {
    if (!this.root.contains(this.main)) this.begin(run.summary.data);
    const shown = this.sections.filter((section) => section.when?.(run) ?? true);
    this.subtitle.textContent = subtitle(run);
    const links = [...(this.lead ? [this.lead] : []), ...shown];
    morph(this.nav, links.map((section) => h('li', {}, h('a', { href: `#${section.id}` }, section.title))));
    morph(this.figures, [figures(run)]);
    morph(this.findings, run.live ? [] : findingItems(run));
    for (const section of this.sections) this.showSection(section, run, shown.includes(section));
    if (run.summary.version !== this.version) {
      this.root.querySelector('footer')?.remove();
      this.root.append(footer(this.version = run.summary.version, this.lead !== null));
    }
  }

  private showSection(section: Section, run: Run, visible: boolean) {
    const before = this.drawn.get(section.id);
    if (before && visible) return before.drawing.update(run);
    if (before) {
      before.drawing.remove();
      before.element.remove();
      this.drawn.delete(section.id);
    }
    if (!visible) return;
    const body = h('div', { class: 'body' });
    const element = h('section', { id: section.id, class: 'section', 'aria-labelledby': `${section.id}-title` },
      h('div', { class: 'margin' }, h('h2', { id: `${section.id}-title` }, section.title), section.note && h('p', {}, section.note)), body);
    const later = this.sections.slice(this.sections.indexOf(section) + 1);
    const next = later.map((s) => this.drawn.get(s.id)?.element).find((e) => e) ?? null;
    this.main.insertBefore(element, next);
    this.drawn.set(section.id, { element, drawing: section.draw(run, body) });  // charts need their width
  }
}
