// The newest images of all cameras, with their keypoints.
import { bytesOf, RigCamera } from './data';
import { h, integer } from './dom';
import { LiveCamera, LiveFrame } from './live_data';
import { morph } from './morph';
import { cameraColour, colour } from './theme';

// Keypoints differ by shape as well as by colour.
type Kind = 'tracked' | 'outliers' | 'unmatched';
const kKinds: [Kind, string, string][] = [
  ['unmatched', 'kp-new', 'new or not matched'], ['tracked', 'kp-tracked', 'tracked landmark'], ['outliers', 'kp-outlier', 'outlier']];

class Panel {
  readonly canvas = h('canvas', { role: 'img' });
  private readonly name = h('span', { class: 'name' });
  private readonly state = h('span', {});
  private readonly counts = h('p', { class: 'states' });
  private readonly swatch = h('span', { class: 'swatch square' });
  readonly element = h('figure', { class: 'live-camera' }, this.canvas,
    h('figcaption', {}, h('p', {}, this.swatch, this.name, this.state), this.counts));
  private size = [640, 480];  // of the last image

  constructor(index: number) { this.swatch.style.setProperty('--swatch', `var(--${cameraColour(index)})`); }

  async show(camera: LiveCamera, name: string, direct: boolean) {
    if (camera.jpeg !== null) this.size = [camera.width, camera.height];
    const image = camera.jpeg === null ? null : await createImageBitmap(new Blob([bytesOf(camera.jpeg)], { type: 'image/jpeg' }));
    this.draw(camera, image);
    image?.close();
    const count = (values: Float32Array) => integer(values.length / 2);
    this.name.textContent = name;
    this.state.className = `camera-state ${camera.state}`;
    this.state.textContent = camera.reason ? `${camera.state}: ${camera.reason}` : camera.state;
    morph(this.counts, [`${count(camera.tracked)} tracked, ${count(camera.outliers)} outliers, ` +
      (direct ? 'tracked directly' : `${count(camera.unmatched)} not matched`)]);
    this.canvas.setAttribute('aria-label', image ? `Image of ${name}` : `${name} has no image`);
  }

  private draw(camera: LiveCamera, image: ImageBitmap | null) {
    const { canvas } = this, [width, height] = this.size;
    canvas.style.aspectRatio = `${width} / ${height}`;
    const shown = Math.max(canvas.clientWidth, 160), ratio = Math.min(devicePixelRatio, 2);
    canvas.width = Math.round(shown * ratio);
    canvas.height = Math.round(shown * ratio * height / width);
    const context = canvas.getContext('2d')!;
    if (image) context.drawImage(image, 0, 0, canvas.width, canvas.height);
    else this.drawNothing(context, camera.reason || 'no image', ratio);
    for (const [kind, name] of kKinds) this.drawKeypoints(context, kind, camera[kind], canvas.width / width, ratio, colour(name));
  }

  private drawNothing(context: CanvasRenderingContext2D, text: string, ratio: number) {
    context.fillStyle = colour('raised');
    context.fillRect(0, 0, context.canvas.width, context.canvas.height);
    context.fillStyle = colour('soft');
    context.font = `${14 * ratio}px system-ui, "Liberation Sans", sans-serif`;
    context.textAlign = 'center';
    context.fillText(text, context.canvas.width / 2, context.canvas.height / 2);
  }

  private drawKeypoints(context: CanvasRenderingContext2D, kind: Kind, points: Float32Array, scale: number, ratio: number, stroke: string) {
    const r = (kind === 'unmatched' ? 1.2 : 2.6) * ratio;
    context.beginPath();
    for (let i = 0; i < points.length; i += 2) {
      const x = (points[i] + 0.5) * scale, y = (points[i + 1] + 0.5) * scale;
      if (kind === 'outliers') {
        context.moveTo(x - r, y - r); context.lineTo(x + r, y + r);
        context.moveTo(x - r, y + r); context.lineTo(x + r, y - r);
      } else {
        context.moveTo(x + r, y);
        context.arc(x, y, r, 0, 2 * Math.PI);
      }
    }
    context.strokeStyle = context.fillStyle = stroke;
    context.lineWidth = 1.3 * ratio;
    if (kind === 'unmatched') context.fill();
    else context.stroke();
  }
}

export class LiveImages {
  private readonly panels: Panel[] = [];
  private readonly grid = h('div', { class: 'live-cameras' });
  readonly element = h('div', {}, this.grid, h('ul', { class: 'legend' }, ...[kKinds[1], kKinds[0], kKinds[2]].map(([kind, name, text]) =>
    h('li', {}, h('span', { class: `keypoint ${kind}`, style: `--swatch: var(--${name})`, 'aria-hidden': 'true' }), text))));

  async show(frame: LiveFrame, rig: RigCamera[]) {
    while (this.panels.length < frame.cameras.length) {
      const panel = new Panel(this.panels.length);
      this.panels.push(panel);
      this.grid.append(panel.element);
    }
    const n = this.panels.length;  // in one row, or in two nearly full ones
    this.grid.style.setProperty('--columns', String(n <= 4 ? n : Math.ceil(n / 2)));
    await Promise.all(frame.cameras.map((camera, c) => this.panels[c].show(camera, rig[c]?.name ?? `camera ${c}`, frame.direct)));
  }
}
