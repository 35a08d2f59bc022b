// A run that goes on: the connection to the program, controls of its pace, and the newest frame.
import { parseData, Run } from './data';
import { decimal, h, integer, seconds } from './dom';
import { LiveImages } from './live_images';
import { LiveFrame, LiveMessage, LiveStart, LiveState } from './live_data';
import { morph } from './morph';
import { Page } from './page';

const kSpeeds: [number, string][] = [[0, 'as fast as possible'], [4, '4 \u00d7 recorded'], [2, '2 \u00d7 recorded'], [1, 'as recorded'],
                                     [0.5, '1/2 recorded'], [0.25, '1/4 recorded'], [0.1, '1/10 recorded']];
const kSmoothing = 0.1;  // of the displayed time per frame

export class LiveView {
  readonly page: Page;
  private readonly pause = h('button', { type: 'button', click: () => this.togglePause() }, 'pause');
  private readonly step = h('button', { type: 'button', click: () => this.send('step') }, 'step');
  private readonly speed = h('select', { change: () => this.send(`speed ${this.speed.value}`) });
  private readonly badge = h('p', { class: 'badge', role: 'status' });
  private readonly numbers = h('p', { class: 'numbers' });
  private readonly images = new LiveImages();
  private socket: WebSocket | null = null;
  private connected = false;
  private state: LiveState;
  private frame: LiveFrame | null = null;
  private frameMs = NaN;
  private run: Run | null = null;

  constructor(root: HTMLElement, private readonly start: LiveStart) {
    this.state = start.state;
    const controls = h('div', { class: 'live-bar', keydown: (event) => this.onKey(event as KeyboardEvent) },
      this.badge, h('div', { class: 'buttons', role: 'group', 'aria-label': 'Run' }, this.pause, this.step),
      h('label', { class: 'check' }, 'speed ', this.speed), this.numbers);
    this.page = new Page(root, { id: 'live', title: 'Live', body: h('div', {}, controls, this.images.element) });
    this.page.begin(start.live.data);
    if (start.run) this.showRun(start.run);
    if (start.frame) void this.showFrame(start.frame);
    this.showState();
    this.connect();
  }

  // ---- Connection

  private connect() {
    const socket = this.socket = new WebSocket(`ws://${location.host}/live${location.search}`);
    socket.onopen = () => { this.connected = true; this.showState(); };
    socket.onmessage = (event) => void this.receive(event.data as string);
    socket.onclose = () => { this.connected = false; this.showState(); };
  }

  // A message is confirmed when it was shown: the program sends the next one of its channel then.
  private async receive(text: string) {
    const message = parseData(text) as LiveMessage;
    try {
      if (message.channel === 'state') { this.state = message.value; this.showState(); }
      if (message.channel === 'run') this.showRun(message.value);
      if (message.channel === 'frame') await this.showFrame(message.value);
    } finally {  // an image that cannot be decoded does not end the updates
      this.send(`got ${message.channel}`);
    }
  }

  private send(text: string) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(text);
  }

  private togglePause() {
    this.state.paused = !this.state.paused;  // as it will be confirmed
    this.send(this.state.paused ? 'pause' : 'resume');
    this.showState();
  }

  private onKey(event: KeyboardEvent) {
    if (event.target === this.speed || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === 'p') this.togglePause();
    else if (event.key === 's') this.send('step');
    else return;
    event.preventDefault();
  }

  // ---- Contents

  private showRun(run: Run) {
    this.run = run;
    this.page.show(run);
    if (!run.live) this.showState();
  }

  private async showFrame(frame: LiveFrame) {
    this.frame = frame;
    this.frameMs = Number.isNaN(this.frameMs) ? frame.ms : this.frameMs + kSmoothing * (frame.ms - this.frameMs);
    this.showState();
    if (frame.pose) this.page.map.addNewest(frame.pose);
    await this.images.show(frame, this.run?.rig ?? []);
  }

  // Whether the run goes on, and how it is.
  private status(): [kind: string, text: string] {
    const { phase, paused } = this.state;
    if (phase === 'ended' || (this.run && !this.run.live)) return ['idle', 'The run has ended. This page keeps what it has.'];
    if (!this.connected && this.socket && this.socket.readyState === WebSocket.CLOSED) return ['lost', 'The connection to the program is lost.'];
    if (phase === 'finishing') return ['idle', 'All frames are processed; the map is adjusted.'];
    if (!this.frame) return ['idle', paused ? 'paused before the first frame' : 'waiting for the first frame'];
    const tracking = this.frame.tracking ? 'tracking' : `lost: ${this.frame.reason}`;
    return [this.frame.tracking ? 'ok' : 'lost', paused ? `${tracking}, paused` : tracking];
  }

  private showState() {
    const [kind, text] = this.status(), going = this.connected && this.state.phase === 'feeding';
    this.badge.className = `badge ${kind}`;
    if (this.badge.textContent !== text) this.badge.textContent = text;
    const label = this.state.paused ? 'resume' : 'pause';
    if (this.pause.textContent !== label) this.pause.textContent = label;
    for (const control of [this.pause, this.step, this.speed]) control.disabled = !going;
    this.showSpeed();
    if (!this.frame) return;
    const { index, time } = this.frame;
    morph(this.numbers, [h('b', {}, `frame ${integer(index + 1)}`), `${this.all()}, at ${seconds(time)}, `,
      h('b', {}, `${decimal(this.frameMs, 1)} ms`), ' / frame']);
  }

  // How many frames there are; nobody knows it of live cameras.
  private all() {
    const { frames } = this.start.live;
    return frames > 0 ? ` of ${integer(frames)}` : '';
  }

  private showSpeed() {
    if (this.start.live.frames === 0) this.speed.parentElement!.style.display = 'none';  // cameras have a pace of their own
    const { speed } = this.state;
    if (!kSpeeds.some(([value]) => value === speed)) kSpeeds.push([speed, `${speed} \u00d7 recorded`]);
    morph(this.speed, kSpeeds.map(([value, text]) => h('option', { value }, text)));
    if (document.activeElement !== this.speed) this.speed.value = String(speed);
  }
}
