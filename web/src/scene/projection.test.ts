import { describe, expect, it } from 'vitest';
import { bearing_deg, distance_m, fit, gridLines, niceLength_m, pan, pixelFromPlace, placeFromPixel, PX_PER_M_MAX, slotPlace, zoom } from './projection';

const size = { width_px: 800, height_px: 600 };
const view = { centre: { north_m: 100, east_m: -50 }, px_per_m: 4 };

describe('the map', () => {
  it('has north up and east right', () => {
    expect(pixelFromPlace(view, size, { north_m: 100, east_m: -50 })).toEqual({ x_px: 400, y_px: 300 });
    expect(pixelFromPlace(view, size, { north_m: 110, east_m: -50 })).toEqual({ x_px: 400, y_px: 260 });
    expect(pixelFromPlace(view, size, { north_m: 100, east_m: -40 })).toEqual({ x_px: 440, y_px: 300 });
  });

  it('goes there and back', () => {
    for (const [x_px, y_px] of [[0, 0], [799, 13], [123.4, 567.8]] as const) {
      const back = pixelFromPlace(view, size, placeFromPixel(view, size, { x_px, y_px }));
      expect(back.x_px).toBeCloseTo(x_px, 9);
      expect(back.y_px).toBeCloseTo(y_px, 9);
    }
  });

  it('moves with the pointer', () => {
    const place = placeFromPixel(view, size, { x_px: 200, y_px: 200 });
    const dragged = pixelFromPlace(pan(view, 37, -21), size, place);
    expect(dragged.x_px).toBeCloseTo(237, 9);
    expect(dragged.y_px).toBeCloseTo(179, 9);
  });

  it('keeps what is under the pointer while zooming, even at the limit', () => {
    const anchor = { x_px: 650, y_px: 80 };
    for (const factor of [1.5, 0.3, 1e6]) {
      const before = placeFromPixel(view, size, anchor);
      const zoomed = zoom(view, size, anchor, factor);
      const after = placeFromPixel(zoomed, size, anchor);
      expect(after.north_m).toBeCloseTo(before.north_m, 9);
      expect(after.east_m).toBeCloseTo(before.east_m, 9);
    }
    expect(zoom(view, size, anchor, 1e6).px_per_m).toBe(PX_PER_M_MAX);
  });

  it('fits everything inside the margin', () => {
    const places = [{ north_m: 0, east_m: 0 }, { north_m: 300, east_m: 20 }, { north_m: -40, east_m: -90 }];
    const fitted = fit(size, places, 50);
    expect(fitted).not.toBeNull();
    for (const place of places) {
      const { x_px, y_px } = pixelFromPlace(fitted!, size, place);
      expect(x_px).toBeGreaterThanOrEqual(50 - 1e-9);
      expect(x_px).toBeLessThanOrEqual(750 + 1e-9);
      expect(y_px).toBeGreaterThanOrEqual(50 - 1e-9);
      expect(y_px).toBeLessThanOrEqual(550 + 1e-9);
    }
  });

  it('fits one place without zooming to infinity, and nothing to nothing', () => {
    expect(fit(size, [{ north_m: 5, east_m: 5 }], 50, 40)?.px_per_m).toBeCloseTo(500 / 40, 9);
    expect(fit(size, [])).toBeNull();
    expect(fit(size, [{ north_m: Number.NaN, east_m: 0 }])).toBeNull();
    expect(fit({ width_px: 0, height_px: 0 }, [{ north_m: 5, east_m: 5 }])).toBeNull();
  });
});

describe('scale bar and grid', () => {
  it.each([
    [1, 120, 100],
    [1, 99, 50],
    [10, 120, 10],
    [0.05, 120, 2000],
    [200, 120, 0.5],
    [2.4, 120, 50],
  ])('at %d px/m, a bar of at most %d px is %d m', (scale, width, expected) => {
    expect(niceLength_m(scale, width)).toBeCloseTo(expected, 9);
    expect(niceLength_m(scale, width) * scale).toBeLessThanOrEqual(width + 1e-6);
  });

  it('lines lie on multiples', () => {
    expect(gridLines(-12, 21, 10)).toEqual([-10, 0, 10, 20]);
    expect(gridLines(1, 2, 10)).toEqual([]);
    expect(gridLines(0, 1, 0)).toEqual([]);
    expect(gridLines(0, Number.POSITIVE_INFINITY, 1)).toEqual([]);
  });
});

describe('formation', () => {
  // Right of a leader that heads east is south; ahead of it is east.
  it.each([
    [0, 0, 7, { north_m: 0, east_m: 7 }],
    [90, 0, 7, { north_m: -7, east_m: 0 }],
    [180, 0, 7, { north_m: 0, east_m: -7 }],
    [270, 3, 0, { north_m: 0, east_m: -3 }],
    [90, 10, 0, { north_m: 0, east_m: 10 }],
  ])('heading %d°: %d m ahead, %d m right', (heading_deg, forward_m, right_m, expected) => {
    const place = slotPlace({ north_m: 0, east_m: 0 }, heading_deg, forward_m, right_m);
    expect(place.north_m).toBeCloseTo(expected.north_m, 9);
    expect(place.east_m).toBeCloseTo(expected.east_m, 9);
  });

  it('bearing and distance', () => {
    expect(distance_m({ north_m: 0, east_m: 0 }, { north_m: 3, east_m: 4 })).toBe(5);
    expect(bearing_deg({ north_m: 0, east_m: 0 }, { north_m: 0, east_m: -1 })).toBeCloseTo(270, 9);
    expect(bearing_deg({ north_m: 0, east_m: 0 }, { north_m: -1, east_m: 0 })).toBeCloseTo(180, 9);
  });
});
