/** The map: pans, zooms, fits, picks vehicles, proposes mission points. */
import { computed, effect, signal, untracked } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { draft, selectedMission } from '../features/missions/selection';
import { judgement, sea } from '../features/sea/selection';
import { fixed, latLon, length } from '../lib/format';
import { theme } from '../lib/theme';
import { select, selection } from '../lib/url-state';
import { fleet, fleetNow_ms, hello, live, now_ms, vehicles } from '../state/store';
import { Icon } from '../ui/Icon';
import { compose, extent, type Composition } from './compose';
import { draw } from './draw';
import { globalFromPlace } from './geodesy';
import { readPalette } from './palette';
import { fit, niceLength_m, pan, pixelFromPlace, placeFromPixel, zoom, type Pixel, type Place, type Size, type View } from './projection';
import { extend, type Trails } from './trails';

const START: View = { centre: { north_m: 0, east_m: 0 }, px_per_m: 6 };
/** Farther than this from where it went down, a press is a drag. */
const DRAG_PX = 6;
const PICK_PX = 24;
const ZOOM_STEP = 1.5;
/** Room for labels around what is fitted. */
const MARGIN_PX = 105;
const SCALE_BAR_PX = 140;

const size = signal<Size>({ width_px: 0, height_px: 0 });
const view = signal<View>(START);
/** Keeps everything in view until a person moves the map. */
const following = signal(true);
const pointer = signal<Place | null>(null);
const trails = signal<Trails>({});

const water = computed(() => {
  const { tone } = judgement.value;
  const place = sea.value?.value.local;
  return tone === 'unknown' || place === undefined ? null : { tone, place };
});

const scene = computed<Composition>(() =>
  compose({
    fleet: fleet.value,
    live: live.value,
    fleetNow_ms: fleetNow_ms.value,
    now_ms: now_ms.value,
    selectedVehicle: selection.value.vehicle,
    mission: selection.value.mission === 'new' ? null : selectedMission.value,
    draft: draft.value,
    water: water.value,
  }),
);

effect(() => {
  const all = vehicles.value;
  untracked(() => {
    let next = trails.value;
    for (const [id, { value }] of Object.entries(all)) {
      const grown = extend(next[id] ?? [], { north_m: value.local.north_m, east_m: value.local.east_m, stamp_ms: Date.parse(value.stamp) });
      if (grown !== next[id]) next = { ...next, [id]: grown };
    }
    trails.value = next;
  });
});

/** Moves the view towards one that shows all, but only when something is near the edge or the fit is much too wide. */
effect(() => {
  const wanted = fit(size.value, extent(scene.value), MARGIN_PX);
  if (!following.value || wanted === null) return;
  untracked(() => {
    const now = view.value;
    const room = size.value;
    const outside = extent(scene.value).some((place) => {
      const { x_px, y_px } = pixelFromPlace(now, room, place);
      return x_px < 60 || y_px < 50 || x_px > room.width_px - 60 || y_px > room.height_px - 95;
    });
    const tighter = wanted.px_per_m / now.px_per_m;
    if (outside || tighter > 1.6) view.value = wanted;
  });
});

const centre = (): Pixel => ({ x_px: size.value.width_px / 2, y_px: size.value.height_px / 2 });
const take = (next: View): void => {
  following.value = false;
  view.value = next;
};
const zoomBy = (factor: number, anchor = centre()): void => take(zoom(view.value, size.value, anchor, factor));
const fitAll = (): void => {
  following.value = true;
  view.value = fit(size.value, extent(scene.value), MARGIN_PX) ?? START;
};

function onKey(event: KeyboardEvent): void {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const step = 60;
  const actions: Record<string, () => void> = {
    ArrowLeft: () => take(pan(view.value, step, 0)),
    ArrowRight: () => take(pan(view.value, -step, 0)),
    ArrowUp: () => take(pan(view.value, 0, step)),
    ArrowDown: () => take(pan(view.value, 0, -step)),
    '+': () => zoomBy(ZOOM_STEP),
    '=': () => zoomBy(ZOOM_STEP),
    '-': () => zoomBy(1 / ZOOM_STEP),
    f: fitAll,
    Enter: () => propose(placeFromPixel(view.value, size.value, centre())),
  };
  const action = actions[event.key];
  if (action === undefined) return;
  event.preventDefault();
  action();
}

/** A press on a vehicle selects it; on water it proposes a mission point there. */
function press(pixel: Pixel): void {
  const near = scene.value.vehicles
    .map((vehicle) => ({ id: vehicle.id, at: pixelFromPlace(view.value, size.value, vehicle.place) }))
    .map(({ id, at }) => ({ id, away_px: Math.hypot(at.x_px - pixel.x_px, at.y_px - pixel.y_px) }))
    .filter(({ away_px }) => away_px < PICK_PX)
    .toSorted((a, b) => a.away_px - b.away_px)[0];
  if (near !== undefined) select({ vehicle: selection.value.vehicle === near.id ? null : near.id });
  else propose(placeFromPixel(view.value, size.value, pixel));
}

function propose(place: Place): void {
  draft.value = { north_m: Math.round(place.north_m * 10) / 10, east_m: Math.round(place.east_m * 10) / 10 };
  select({ mission: 'new', tab: 'mission' });
}

/** Pointers that are down, for dragging with one and pinching with two. */
function gestures(canvas: HTMLCanvasElement): () => void {
  const down = new Map<number, Pixel>();
  let moved_px = 0;
  const where = (event: PointerEvent | WheelEvent): Pixel => {
    const box = canvas.getBoundingClientRect();
    return { x_px: event.clientX - box.left, y_px: event.clientY - box.top };
  };
  const on = <K extends keyof HTMLElementEventMap>(name: K, handler: (event: HTMLElementEventMap[K]) => void): void =>
    canvas.addEventListener(name, handler, { passive: false, signal: stop.signal });
  const stop = new AbortController();
  on('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (down.size === 0) moved_px = 0;
    down.set(event.pointerId, where(event));
  });
  on('pointermove', (event) => {
    const now = where(event);
    pointer.value = placeFromPixel(view.value, size.value, now);
    const before = down.get(event.pointerId);
    if (before === undefined) return;
    const [right, below] = [now.x_px - before.x_px, now.y_px - before.y_px];
    moved_px += Math.hypot(right, below);
    if (down.size === 1 && moved_px > DRAG_PX) take(pan(view.value, right, below));
    const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
    if (other !== undefined) {
      const span = (a: Pixel): number => Math.max(10, Math.hypot(a.x_px - other.x_px, a.y_px - other.y_px));
      const middle = { x_px: (now.x_px + other.x_px) / 2, y_px: (now.y_px + other.y_px) / 2 };
      take(zoom(pan(view.value, right / 2, below / 2), size.value, middle, span(now) / span(before)));
    }
    down.set(event.pointerId, now);
  });
  on('pointerup', (event) => {
    const alone = down.size === 1;
    down.delete(event.pointerId);
    if (alone && moved_px <= DRAG_PX && event.button === 0) press(where(event));
  });
  on('pointercancel', (event) => void down.delete(event.pointerId));
  on('pointerleave', () => (pointer.value = null));
  on('wheel', (event) => {
    event.preventDefault();
    zoomBy(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0015)), where(event));
  });
  return () => stop.abort();
}

export function MapScope() {
  const canvasRef = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const canvas = canvasRef.current;
    const ctx = canvas?.getContext('2d');
    if (!canvas || !ctx) return;
    const observer = new ResizeObserver(() => {
      size.value = { width_px: canvas.clientWidth, height_px: canvas.clientHeight };
    });
    observer.observe(canvas);
    const ungesture = gestures(canvas);
    let queued = 0;
    const undraw = effect(() => {
      // Everything that the picture rests on is read here; the drawing itself waits for the next frame.
      const [picture, lines, where, room] = [scene.value, trails.value, view.value, size.value];
      void theme.value;
      cancelAnimationFrame(queued);
      queued = requestAnimationFrame(() => {
        const ratio = window.devicePixelRatio || 1;
        const [w, h] = [Math.round(room.width_px * ratio), Math.round(room.height_px * ratio)];
        if (canvas.width !== w) canvas.width = w;
        if (canvas.height !== h) canvas.height = h;
        ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
        draw({ ctx, size: room, view: where, palette: readPalette(canvas) }, picture, lines);
      });
    });
    return () => {
      undraw();
      cancelAnimationFrame(queued);
      ungesture();
      observer.disconnect();
    };
  }, []);

  return (
    <section class="map" aria-label="Map">
      <canvas
        ref={canvasRef}
        class="map-canvas"
        data-testid="map"
        tabIndex={0}
        role="application"
        // Says nothing that changes: the fleet list holds the same in words, without interrupting.
        aria-label="Map of the fleet, north up. Arrow keys move, plus and minus zoom, F shows everything, Enter proposes a mission at the centre."
        onKeyDown={onKey}
      />
      <div class="map-north" aria-hidden="true">
        <Icon name="north" />
        <span>N</span>
      </div>
      <div class="map-tools" role="group" aria-label="Map view">
        <button class="tool" onClick={() => zoomBy(ZOOM_STEP)} aria-label="Zoom in"><Icon name="plus" /></button>
        <button class="tool" onClick={() => zoomBy(1 / ZOOM_STEP)} aria-label="Zoom out"><Icon name="minus" /></button>
        <button class="tool" onClick={fitAll} aria-pressed={following.value} aria-label="Show everything and follow" data-testid="map-fit"><Icon name="fit" /></button>
      </div>
      <ScaleBar />
      <Coordinates />
      {!live.value && <div class="map-veil" data-testid="map-veil">Positions are history, not the present</div>}
    </section>
  );
}

function ScaleBar() {
  const length_m = niceLength_m(view.value.px_per_m, SCALE_BAR_PX);
  return (
    <div class="map-scale" aria-hidden="true">
      <span>{length_m < 1 ? `${fixed(length_m * 100, 0)} cm` : length_m < 1000 ? `${length_m} m` : `${length_m / 1000} km`}</span>
      <i style={{ width: `${length_m * view.value.px_per_m}px` }} />
    </div>
  );
}

function Coordinates() {
  const place = pointer.value;
  const origin = hello.value?.origin;
  if (!live.value) return null;
  if (place === null) return <div class="map-coordinates map-hint">Click on the water to propose a mission</div>;
  const global = origin === undefined ? null : globalFromPlace(origin, place);
  return (
    <div class="map-coordinates" aria-hidden="true">
      <b>N {length(place.north_m)} E {length(place.east_m)}</b>
      {global !== null && <span>{latLon(global.latitude_deg, global.longitude_deg)}</span>}
    </div>
  );
}
