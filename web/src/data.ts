// The data of the page, as written by src/session/report_data.cc. Times are in seconds since the first image of the data
// set, lengths in metres if the scale of the map is metric. NaN in an array stands for a value that does not exist.

export interface Statistics { median: number | null; p95: number | null; max: number | null; count?: number }
export interface Interval { from: number; to: number; reason: string }
export interface CameraInterval extends Interval { state: 'ok' | 'degraded' | 'out' }
export interface PlaceEvent { at: number; with: number; inliers: number }
export interface Refinement { change: number; std: number | null }

export interface CalibratedCamera {
  name: string;
  intrinsics: Record<string, Refinement>;
  rotation_deg: number; rotation_std_deg: number | null;
  translation_mm: number; translation_std_mm: number | null;
  time_offset_ms: number; time_offset_std_ms: number | null;
  readout_ms: number; readout_std_ms: number | null;
}

// Cameras that should see the same things but do not.
export interface CameraPair { cameras: string[]; overlap: number; matched_share: number | null; contradicted: boolean; evidence: string | null }

export interface SummaryCamera {
  name: string; images: number; skipped: number;
  states: CameraInterval[];
  reprojection: { rms_px: number | null; observations: number; inlier_share: number | null };
  extrinsics: { suspect: boolean } | null;
}

// summary.json
export interface Summary {
  version: string; complete: boolean; data: string; mode: string; seed: number; cameras_used: number[];
  frames: { input: number; tracked: number; lost: number; dropped: number; in_loaded_map: number | null; lost_intervals: Interval[] };
  cameras: SummaryCamera[];
  calibration: {
    verdict: 'consistent' | 'inconsistent' | 'unknown'; excess_error: number | null; excess_bound: number; refined: boolean;
    pairs: CameraPair[]; disagreeing: string[];
    cameras: CalibratedCamera[];
  };
  features: { keypoints_per_image: number | null; unique: number | null; monocular: number | null; matched: number | null };
  map: {
    keyframes: number; landmarks: number; observations: number; scale: string; scale_std: number | null; loaded: boolean;
  };
  loops: PlaceEvent[]; relocalisations: PlaceEvent[];
  maps_started: number;
  time: { start_up_s: number; wall_s: number; frame_ms: Statistics; stages_ms: Record<string, Statistics> };
  memory: { peak_mb: number | null };
  warnings: string[];
}

export interface RigCamera {
  name: string; model: string; width: number; height: number;
  position: number[]; rotation: number[];  // pose in the rig; quaternions are x y z w
  corners: number[][];                     // of the image, at depth 1
}

// A part of the map with its own world frame.
export interface Submap {
  root: number;  // identifies it while a run goes on
  loaded: boolean; frames: number;
  up: number[];
  path: { time: Float32Array; position: Float32Array; rotation: Float32Array };
  keyframes: { time: Float32Array; position: Float32Array; rotation: Float32Array };
  loops: [number, number][];  // keyframes at both ends of each loop closure
  points: { position: Float32Array; time: Float32Array };
}

export interface FrameCounts { keypoints: Float32Array; matched: Float32Array; inliers: Float32Array }

export interface Stage {
  name: string; background: boolean; total_ms: number;
  time: Float32Array; ms: Float32Array;
}

// Mean residuals (observed minus projected) in cells of the image, row by row.
export interface Residuals {
  width: number; height: number; columns: number; rows: number; observations: number; rms_px: number;
  mean_px: Float32Array; count: Float32Array;
}

export interface Truth {
  error?: string;  // why the ground truth could not be used; nothing else is present then
  note: string | null;  // what to know about the comparison
  file: string; scale_aligned: boolean;
  ate_m: { rmse: number | null; median: number | null; max: number | null; count: number };
  rpe_delta_s: number;
  rpe_m: { rmse: number | null }; rpe_deg: { rmse: number | null };
  scale: number | null; coverage: number | null; length_m: number | null;
  time: Float32Array; error_m: Float32Array; path: Float32Array;
}

export interface Setting { key: string; value: string; default: string; unit: string; help: string }

export interface Run {
  schema: number; command: string; summary: Summary;
  rig: RigCamera[]; submaps: Submap[]; landmarks: number;
  frames: { time: Float32Array; ms: Float32Array; direct: number; cameras: FrameCounts[] };
  live?: boolean;  // the run goes on: what is known at its end only is missing
  stages: Stage[]; residuals: Residuals[]; truth: Truth | null; settings: Setting[];
}

function floats(base64: string): Float32Array {
  return new Float32Array(bytesOf(base64).buffer);
}

// Parses the data of a run; returns null if there are none.
export function parseRun(json: string): Run | null {
  return parseData(json);
}

// Parses JSON with arrays of numbers.
export function parseData(json: string) {
  return JSON.parse(json, (_, value) => (typeof value?.f32 === 'string' ? floats(value.f32) : value));
}

export function bytesOf(base64: string): Uint8Array<ArrayBuffer> {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

// ---- Values derived from the data

export const isMetric = (run: Run) => run.summary.map.scale === 'metric';
export const lengthUnit = (run: Run) => (isMetric(run) ? 'm' : 'map units');

export function timeRange(run: Run): [number, number] {
  const time = run.frames.time;
  return time.length ? [time[0], Math.max(time[time.length - 1], time[0] + 1e-3)] : [0, 1];
}

export function pathLength(position: Float32Array): number {
  let length = 0;
  for (let i = 3; i < position.length; i += 3) {
    length += Math.hypot(position[i] - position[i - 3], position[i + 1] - position[i - 2], position[i + 2] - position[i - 1]);
  }
  return length;
}

// Index of the sample nearest in time; times are ascending.
export function nearest(time: Float32Array, t: number): number {
  let low = 0, high = time.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (time[middle] <= t) low = middle; else high = middle;
  }
  return high >= 0 && Math.abs(time[high] - t) < Math.abs(time[low] - t) ? high : low;
}

// Index ranges [from, to) of the path in which no frame was lost.
export function unbrokenParts(run: Run, submap: Submap): [number, number][] {
  const time = submap.path.time, parts: [number, number][] = [];
  let from = 0;
  for (let i = 1; i <= time.length; ++i) {
    const lost = i < time.length &&
      run.summary.frames.lost_intervals.some((l) => l.from > time[i - 1] && l.from < time[i]);
    if (i === time.length || lost) {
      parts.push([from, i]);
      from = i;
    }
  }
  return parts;
}

export function quantile(values: ArrayLike<number>, share: number): number {
  const sorted = Float32Array.from(values).filter((v) => !Number.isNaN(v)).sort();
  return sorted.length ? sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] : NaN;
}
