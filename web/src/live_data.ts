// The messages of a live run, as written by src/live_view. Arrays of keypoints are x, y, x, y ... in pixels of the whole image.
import { Run } from './data';

export interface LiveCamera {
  state: 'ok' | 'degraded' | 'out'; reason: string;
  width: number; height: number;
  jpeg: string | null;  // base64; null: there is no image
  tracked: Float32Array;    // landmarks that support the pose
  outliers: Float32Array;   // matched with landmarks that do not
  unmatched: Float32Array;  // with no landmark; possible new ones
}

export interface LivePose { root: number; position: number[]; rotation: number[] }

export interface LiveFrame {
  index: number; time: number; ms: number;
  tracking: boolean; reason: string; keyframe: boolean; direct: boolean;
  pose: LivePose | null;
  cameras: LiveCamera[];
}

export interface LiveState { phase: 'feeding' | 'finishing' | 'ended'; paused: boolean; speed: number; fed: number }

export type LiveMessage = { channel: 'frame'; value: LiveFrame } | { channel: 'state'; value: LiveState } | { channel: 'run'; value: Run };

// The data in the page when it was loaded.
export interface LiveStart {
  live: { data: string; frames: number };  // 0: live cameras, which have no last frame
  state: LiveState;
  frame?: LiveFrame;
  run?: Run;
}
