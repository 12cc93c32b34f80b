/** Water elevation under the rig over the observation window. */
import { effect } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import type { SeaState } from '../../api/types';
import { fixed, quantity, waveHeight } from '../../lib/format';
import { theme } from '../../lib/theme';
import { Panel } from '../../ui/Panel';
import { judgement, sea } from './selection';

const EMPTY_CHART: uPlot.AlignedData = [[], []];

/** Seconds before the newest, and centimetres: the scale of what is decided. */
const chartData = (state: SeaState | undefined): uPlot.AlignedData =>
  state === undefined ? EMPTY_CHART : [state.trace.map((one) => one.t_s), state.trace.map((one) => one.elevation_m * 100)];

function options(element: HTMLElement): uPlot.Options {
  const style = getComputedStyle(element);
  const colour = (name: string): string => style.getPropertyValue(name).trim();
  const axis = { stroke: colour('--ink-2'), grid: { stroke: colour('--line'), width: 1 }, ticks: { stroke: colour('--line'), width: 1 }, font: '12px ui-sans-serif, system-ui, sans-serif' };
  return {
    width: Math.max(120, element.clientWidth),
    height: Math.max(100, element.clientHeight),
    legend: { show: false },
    cursor: { y: false },
    padding: [10, 14, 0, 0],
    scales: {
      x: { time: false },
      // Symmetric about the mean level and never narrower than 2 cm, so that still water looks still.
      y: { range: (_, low, high) => { const top = Math.max(1, Math.abs(low ?? 0), Math.abs(high ?? 0)) * 1.15; return [-top, top]; } },
    },
    axes: [
      { ...axis, size: 28, values: (_, all) => all.map((value) => `${fixed(value, 0)} s`) },
      { ...axis, size: 58, space: 22, values: (_, all) => all.map((value) => `${fixed(value, Math.abs((all[1] ?? 1) - (all[0] ?? 0)) < 1 ? 1 : 0)} cm`) },
    ],
    series: [{}, { stroke: colour('--chart-line'), width: 2, fill: colour('--chart-fill'), fillTo: 0, points: { show: false } }],
  };
}

export function TracePanel() {
  const holder = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const element = holder.current;
    if (element === null) return;
    let plot: uPlot | null = null;
    // Colours are set when a chart is made, so that a new theme makes a new one.
    const unthemed = effect(() => {
      void theme.value;
      plot?.destroy();
      plot = new uPlot(options(element), chartData(sea.peek()?.value), element);
    });
    const unfed = effect(() => plot?.setData(chartData(sea.value?.value)));
    const observer = new ResizeObserver(() => plot?.setSize({ width: Math.max(120, element.clientWidth), height: Math.max(100, element.clientHeight) }));
    observer.observe(element);
    return () => {
      observer.disconnect();
      unfed();
      unthemed();
      plot?.destroy();
    };
  }, []);

  const state = sea.value?.value;
  const heights = state?.trace.map((one) => one.elevation_m) ?? [];
  const summary = heights.length === 0 ? 'No trace yet.' : `Elevation between ${waveHeight(Math.min(...heights))} and ${waveHeight(Math.max(...heights))} over ${fixed(state?.window_s ?? 0, 0)} seconds.`;
  return (
    <Panel title="Elevation" class="trace" testid="trace" aside={<span class="count">{state === undefined ? '' : `${fixed(state.window_s, 0)} s · ${state.patches} patches · ${fixed(state.coverage * 100, 0)} % seen`}</span>}>
      {state !== undefined && <Statistics state={state} />}
      <div class={`chart ${heights.length === 0 ? 'none' : ''} ${judgement.value.left_s === null ? 'history' : ''}`} ref={holder} role="img" aria-label={summary} />
      {heights.length === 0 && <p class="chart-empty">No elevation measured yet</p>}
    </Panel>
  );
}

/** The other numbers of the window. */
function Statistics({ state }: { state: SeaState }) {
  return (
    <dl class={`stats ${judgement.value.left_s === null ? 'history' : ''}`}>
      <Stat name="Mean" value={waveHeight(state.h_mean_m?.value)} />
      <Stat name="Highest" value={waveHeight(state.h_max_m?.value)} />
      <Stat name="Period" value={quantity(state.t_z_s?.value, 2, 's')} />
      <Stat name="Slope" value={quantity(state.slope_rms_rad === null ? null : (state.slope_rms_rad.value * 180) / Math.PI, 1, '°')} />
      <Stat name="Waves" value={String(state.waves)} />
    </dl>
  );
}

const Stat = ({ name, value }: { name: string; value: string }) => (
  <div><dt>{name}</dt><dd>{value}</dd></div>
);
