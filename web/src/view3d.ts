// The map in 3D: landmarks, path, keyframes, frusta of the cameras, loop closures and ground truth. It is drawn only when
// something has changed.
import * as three from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import { LineSegments2 } from 'three/examples/jsm/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/examples/jsm/lines/LineSegmentsGeometry.js';
import { nearest, quantile, RigCamera, Run, Submap, timeRange, unbrokenParts } from './data';
import { roundedDown } from './dom';
import { cameraColour, colour, onTheme, scaleColour } from './theme';

export interface ViewSettings {
  submap: number;
  colouring: 'height' | 'age' | 'plain';
  points: boolean; keyframes: boolean; loops: boolean; truth: boolean;
  frusta: 'time' | 'keyframes' | 'none';
  time: number;  // the pose at this time is marked
}

export interface ColourRange { from: number; to: number }

type Vector = [number, number, number];
const at = (values: ArrayLike<number>, i: number): Vector => [values[3 * i], values[3 * i + 1], values[3 * i + 2]];
const quaternion = (values: ArrayLike<number>, i: number) =>
  new three.Quaternion(values[4 * i], values[4 * i + 1], values[4 * i + 2], values[4 * i + 3]);

// Position of the scene in its view: the middle and half the size of what is worth looking at.
interface Extent { centre: three.Vector3; radius: number; floor: number; path: number }

export class MapView {
  readonly element: HTMLCanvasElement;
  gridSpacing = 1;
  private readonly renderer: three.WebGLRenderer;
  private readonly scene = new three.Scene();
  private readonly camera = new three.PerspectiveCamera(40, 1, 0.01, 1e5);
  private readonly controls: OrbitControls;
  private readonly world = new three.Group();   // in the frame of the submap, turned so that y is up
  private readonly rig = new three.Group();     // frusta at the selected time
  private cloud: three.Points | null = null;
  private extent: Extent = { centre: new three.Vector3(), radius: 1, floor: 0, path: 1 };
  private requested = false;
  // Where the view was placed by `lookFrom`, and whether the user has moved it since.
  private placed = { direction: new three.Vector3(-0.55, 0.75, 0.85), centre: new three.Vector3(), radius: 0 };
  private moved = false;
  private tail: LineSegments2 | null = null;  // the path since the data of the run
  private readonly stopTheme: () => void;

  // Returns null if the browser cannot draw in 3D.
  static create(canvas: HTMLCanvasElement): MapView | null {
    const context = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });
    return context ? new MapView(canvas, context) : null;
  }

  private constructor(canvas: HTMLCanvasElement, context: WebGL2RenderingContext) {
    this.element = canvas;
    this.renderer = new three.WebGLRenderer({ canvas, context, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene.add(this.world);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', () => this.request());
    this.controls.addEventListener('start', () => { this.moved = true; });
    canvas.addEventListener('keydown', (event) => this.onKey(event));
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.stopTheme = onTheme(() => { this.recolour(); this.renderNow(); });
  }

  dispose() {
    this.stopTheme();
    this.controls.dispose();
    this.renderer.dispose();
  }

  // ---- Contents

  private run!: Run;
  private submap!: Submap;
  private settings!: ViewSettings;

  // Draws a run. `keepView`: the same submap was shown before, and is looked at from the same place, except if the user has
  // not moved and the scene has outgrown the view.
  show(run: Run, settings: ViewSettings, keepView: boolean) {
    this.run = run;
    this.settings = settings;
    this.submap = run.submaps[settings.submap];
    const [x, y, z] = this.submap.up;
    this.world.quaternion.setFromUnitVectors(new three.Vector3(x, y, z), new three.Vector3(0, 1, 0));
    this.world.updateMatrixWorld();
    this.extent = this.measure();
    this.rebuild();
    if (!keepView) this.oblique();
    else if (!this.moved && this.outgrown()) this.lookFrom(this.placed.direction);
    this.resize();
  }

  update(settings: ViewSettings) {
    this.settings = settings;
    this.rebuild();
  }

  private outgrown(): boolean {
    const { centre, radius } = this.extent, before = this.placed;
    return centre.distanceTo(before.centre) > 0.15 * before.radius || radius > 1.2 * before.radius || radius < 0.7 * before.radius;
  }

  // Marks a pose that is newer than the path, which is continued through `positions`.
  setNewest(positions: number[], rotation: number[]) {
    if (this.tail) this.discard(this.tail);
    this.tail = null;
    const path = this.submap.path.position, lines: number[] = [];
    const all = path.length ? [...at(path, path.length / 3 - 1), ...positions] : positions;
    for (let i = 1; i < all.length / 3; ++i) lines.push(...at(all, i - 1), ...at(all, i));
    if (lines.length) this.world.add(this.tail = this.segments(lines, 'path', 2.5));
    this.rig.position.set(...at(all, all.length / 3 - 1));
    this.rig.quaternion.copy(quaternion(rotation, 0));
    this.request();
  }

  setTime(time: number) {
    this.settings.time = time;
    this.placeRig();
    this.request();
  }

  private rebuild() {
    for (const child of [...this.world.children]) this.discard(child);
    this.tail = null;
    this.addGrid();
    this.addPoints();
    this.addPath();
    if (this.settings.truth && this.run.truth && !this.run.truth.error && this.settings.submap === 0) this.addTruth();
    if (this.settings.keyframes) this.addKeyframes();
    if (this.settings.loops) this.addLoops();
    this.addRig();
    this.request();
  }

  private discard(object: three.Object3D) {
    object.removeFromParent();
    object.traverse((part) => {
      if ('geometry' in part) (part.geometry as three.BufferGeometry).dispose();
      if ('material' in part) (part.material as three.Material).dispose();
    });
  }

  // Position `i` in the scene, where y is up.
  private inScene(values: ArrayLike<number>, i: number): three.Vector3 {
    return new three.Vector3(...at(values, i)).applyMatrix4(this.world.matrixWorld);
  }

  // The path and most of the landmarks around it. Far landmarks, whose depth is uncertain, do not count.
  private measure(): Extent {
    const { path, points, keyframes } = this.submap;
    const positions = path.position.length ? path.position : keyframes.position;
    const box = new three.Box3();
    for (let i = 0; i < positions.length / 3; ++i) box.expandByPoint(this.inScene(positions, i));
    if (box.isEmpty()) box.expandByPoint(new three.Vector3());
    const middle = box.getCenter(new three.Vector3()), pathRadius = box.getSize(new three.Vector3()).length() / 2;
    const step = Math.max(1, Math.floor(points.time.length / 5000)), near: three.Vector3[] = [];
    for (let i = 0; i < points.time.length; i += step) near.push(this.inScene(points.position, i));
    if (near.length) {
      const reach = Math.max(1.5 * pathRadius, quantile(near.map((p) => p.distanceTo(middle)), 0.8));
      const kept = near.filter((p) => p.distanceTo(middle) <= reach);
      const share = (s: number) => new three.Vector3(...(['x', 'y', 'z'] as const).map((axis) => quantile(kept.map((p) => p[axis]), s)));
      if (kept.length) box.expandByPoint(share(0.04)).expandByPoint(share(0.94));
    }
    const size = box.getSize(new three.Vector3());
    return { centre: box.getCenter(new three.Vector3()), radius: Math.max(size.length() / 2, 1e-6), floor: box.min.y, path: pathRadius };
  }

  private addGrid() {
    const { centre, radius, floor } = this.extent;
    this.gridSpacing = roundedDown(radius / 3);
    const lines = 2 * Math.ceil(1.4 * radius / this.gridSpacing), size = lines * this.gridSpacing;
    const grid = new three.GridHelper(size, lines, colour('grid'), colour('grid'));
    const snap = (v: number) => Math.round(v / this.gridSpacing) * this.gridSpacing;
    const holder = new three.Group();
    holder.quaternion.copy(this.world.quaternion).invert();
    grid.position.set(snap(centre.x), floor, snap(centre.z));
    holder.add(grid);
    this.world.add(holder);
  }

  // The values by which points are coloured: height above camera 0 at the start, or time of creation.
  private pointValues(): { values: Float32Array; range: ColourRange } {
    const { points, up } = this.submap;
    if (this.settings.colouring === 'age') {
      const start = timeRange(this.run)[0];  // landmarks of a loaded map are older than the run
      return { values: points.time, range: { from: Math.max(quantile(points.time, 0), start), to: quantile(points.time, 1) } };
    }
    const values = new Float32Array(points.time.length);
    for (let i = 0; i < values.length; ++i) {
      values[i] = up[0] * points.position[3 * i] + up[1] * points.position[3 * i + 1] + up[2] * points.position[3 * i + 2];
    }
    const { centre, radius } = this.extent;
    const near = values.filter((_, i) => i % 7 === 0 && this.inScene(points.position, i).distanceTo(centre) < radius);
    return { values, range: { from: quantile(near, 0.02), to: quantile(near, 0.95) } };
  }

  colourRange(): ColourRange { return this.pointValues().range; }

  private pointColours(): Float32Array {
    const { values, range } = this.pointValues();
    const colours = new Float32Array(3 * values.length);
    const plain = new three.Color(colour('point'));
    const table = Array.from({ length: 256 }, (_, i) => new three.Color().setRGB(...scaleColour(i / 255), three.SRGBColorSpace));
    const width = Math.max(range.to - range.from, 1e-9);
    for (let i = 0; i < values.length; ++i) {
      const share = (values[i] - range.from) / width;
      const c = this.settings.colouring === 'plain' ? plain : table[Math.round(255 * Math.min(1, Math.max(0, share)))];
      colours.set([c.r, c.g, c.b], 3 * i);
    }
    return colours;
  }

  private addPoints() {
    this.cloud = null;
    if (!this.settings.points) return;
    const geometry = new three.BufferGeometry();
    geometry.setAttribute('position', new three.BufferAttribute(this.submap.points.position, 3));
    geometry.setAttribute('color', new three.BufferAttribute(this.pointColours(), 3));
    const count = this.submap.points.time.length;
    const size = count > 30000 ? 1.5 : count > 8000 ? 2 : 2.6;
    this.cloud = new three.Points(geometry, new three.PointsMaterial({
      size: size * this.renderer.getPixelRatio(), sizeAttenuation: false, vertexColors: true }));
    this.cloud.frustumCulled = false;
    this.world.add(this.cloud);
  }

  private segments(vertices: number[], name: string, width: number, dashed = false) {
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(vertices);
    const material = new LineMaterial({ color: new three.Color(colour(name)).getHex(), linewidth: width, dashed });
    if (dashed) { material.dashSize = material.gapSize = this.extent.radius / 60; }
    const lines = new LineSegments2(geometry, material);
    if (dashed) lines.computeLineDistances();
    lines.frustumCulled = false;
    return lines;
  }

  private addPath() {
    const position = this.submap.path.position, whole: number[] = [], gaps: number[] = [];
    let last = -1;
    for (const [from, to] of unbrokenParts(this.run, this.submap)) {
      if (last >= 0) gaps.push(...at(position, last), ...at(position, from));
      for (let i = from + 1; i < to; ++i) whole.push(...at(position, i - 1), ...at(position, i));
      last = to - 1;
    }
    if (whole.length) this.world.add(this.segments(whole, 'path', 2.5));
    if (gaps.length) this.world.add(this.segments(gaps, 'lost', 2, true));
  }

  private addTruth() {
    const path = this.run.truth!.path, lines: number[] = [];
    for (let i = 1; i < path.length / 3; ++i) lines.push(...at(path, i - 1), ...at(path, i));
    if (lines.length) this.world.add(this.segments(lines, 'truth', 1.5));
  }

  private addKeyframes() {
    const { keyframes } = this.submap;
    const geometry = new three.BufferGeometry();
    geometry.setAttribute('position', new three.BufferAttribute(keyframes.position, 3));
    const points = new three.Points(geometry, new three.PointsMaterial({
      size: 5 * this.renderer.getPixelRatio(), sizeAttenuation: false, color: colour('keyframe') }));
    points.frustumCulled = false;
    this.world.add(points);
    if (this.settings.frusta !== 'keyframes') return;
    this.run.rig.forEach((camera, c) => {
      const lines: number[] = [];
      for (let i = 0; i < keyframes.time.length; ++i) {
        const pose = new three.Matrix4().compose(new three.Vector3(...at(keyframes.position, i)), quaternion(keyframes.rotation, i), new three.Vector3(1, 1, 1));
        for (const v of this.frustum(camera, 0.7)) lines.push(...v.applyMatrix4(pose).toArray());
      }
      if (lines.length) this.world.add(this.segments(lines, cameraColour(c), 1));
    });
  }

  // Pairs of ends of lines, in the frame of the rig. A short bar marks the upper edge of the image.
  private frustum(camera: RigCamera, scale: number): three.Vector3[] {
    const depth = scale * Math.min(0.085 * this.extent.radius, 0.2 * Math.max(this.extent.path, 0.2 * this.extent.radius));
    const pose = new three.Matrix4().compose(new three.Vector3(...(camera.position as Vector)),
      new three.Quaternion(...(camera.rotation as [number, number, number, number])), new three.Vector3(1, 1, 1));
    const centre = new three.Vector3().applyMatrix4(pose);
    const corners = camera.corners.map((ray) => {
      const v = new three.Vector3(...(ray as Vector));
      return v.multiplyScalar(depth / Math.max(1, v.length() / 1.4)).applyMatrix4(pose);
    });
    const lines: three.Vector3[] = [];
    corners.forEach((corner, i) => lines.push(centre, corner, corner, corners[(i + 1) % 4]));
    return lines.map((v) => v.clone());
  }

  private addRig() {
    this.rig.clear();
    if (this.settings.frusta === 'none' || !this.submap.path.time.length) return;
    this.run.rig.forEach((camera, c) => {
      const lines = this.frustum(camera, 1.6).flatMap((v) => v.toArray());
      this.rig.add(this.segments(lines, cameraColour(c), 2));
    });
    this.world.add(this.rig);
    this.placeRig();
  }

  private placeRig() {
    const { path } = this.submap;
    if (!path.time.length) return;
    const i = nearest(path.time, this.settings.time);
    this.rig.position.set(...at(path.position, i));
    this.rig.quaternion.copy(quaternion(path.rotation, i));
  }

  private addLoops() {
    const { keyframes, loops } = this.submap, lines: number[] = [], ends: number[] = [];
    for (const [newer, older] of loops) {
      const here = at(keyframes.position, newer);
      lines.push(...here, ...at(keyframes.position, older));
      ends.push(...here);
    }
    if (!lines.length) return;
    this.world.add(this.segments(lines, 'loop', 3));
    const geometry = new three.BufferGeometry();
    geometry.setAttribute('position', new three.Float32BufferAttribute(ends, 3));
    const points = new three.Points(geometry, new three.PointsMaterial({
      size: 10 * this.renderer.getPixelRatio(), sizeAttenuation: false, color: colour('loop') }));
    points.frustumCulled = false;
    this.world.add(points);
  }

  private recolour() {
    if (this.submap) this.rebuild();
  }

  // ---- Point of view

  oblique() { this.lookFrom(new three.Vector3(-0.55, 0.75, 0.85)); }
  fromAbove() { this.lookFrom(new three.Vector3(0, 1, 1e-3)); }

  private lookFrom(direction: three.Vector3) {
    const { centre, radius } = this.extent;
    this.placed = { direction: direction.clone(), centre: centre.clone(), radius };
    this.moved = false;
    const aspect = this.element.clientWidth / Math.max(1, this.element.clientHeight);
    const forward = new three.Vector3(0, 0, 1).applyQuaternion(this.world.quaternion);
    const heading = Math.atan2(forward.x, -forward.z);  // the first camera of the rig looks away from the viewer
    const offset = direction.clone().normalize().applyAxisAngle(new three.Vector3(0, 1, 0), -heading);
    const half = three.MathUtils.degToRad(this.camera.fov / 2);
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(offset, 0.82 * radius / Math.sin(half) / Math.min(1, aspect));
    this.camera.near = radius / 300;
    this.camera.far = radius * 100;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.request();
  }

  private onKey(event: KeyboardEvent) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = Math.PI / 36;
    const turns: Record<string, [number, number]> = {
      ArrowLeft: [step, 0], ArrowRight: [-step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    if (turns[event.key]) this.turn(...turns[event.key]);
    else if (event.key === '+' || event.key === '=') this.zoom(1 / 1.15);
    else if (event.key === '-' || event.key === '_') this.zoom(1.15);
    else if (event.key === 'Home') this.oblique();
    else if (event.key === 'End') this.fromAbove();
    else return;
    event.preventDefault();
  }

  private turn(azimuth: number, polar: number) {
    this.moved = true;
    const offset = new three.Spherical().setFromVector3(this.camera.position.clone().sub(this.controls.target));
    offset.theta += azimuth;
    offset.phi = Math.min(Math.PI - 0.01, Math.max(0.01, offset.phi + polar));
    this.camera.position.setFromSpherical(offset).add(this.controls.target);
    this.controls.update();
    this.request();
  }

  zoom(factor: number) {
    this.moved = true;
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.controls.update();
    this.request();
  }

  // Index of the keyframe drawn nearest to a position in the canvas, in CSS pixels; -1 if none is near.
  pick(x: number, y: number): number {
    const { keyframes } = this.submap, point = new three.Vector3();
    let best = -1, bestDistance = 14;
    for (let i = 0; i < keyframes.time.length; ++i) {
      point.set(...at(keyframes.position, i)).applyMatrix4(this.world.matrixWorld).project(this.camera);
      if (point.z > 1) continue;
      const distance = Math.hypot((point.x + 1) / 2 * this.element.clientWidth - x, (1 - point.y) / 2 * this.element.clientHeight - y);
      if (distance < bestDistance) [best, bestDistance] = [i, distance];
    }
    return best;
  }

  // ---- Drawing

  private resize() {
    const width = this.element.clientWidth, height = this.element.clientHeight;
    if (!width || !height) return;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(width, height, false);
    this.renderNow();
  }

  private request() {
    if (this.requested) return;
    this.requested = true;
    requestAnimationFrame(() => this.renderNow());
  }

  private renderNow() {
    this.requested = false;
    if (!this.submap) return;
    this.renderer.setClearColor(colour('view-ground'));
    this.renderer.render(this.scene, this.camera);
  }
}
