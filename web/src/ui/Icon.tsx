/** Line icons on a 24 × 24 grid, drawn with the text's colour. */
const PATHS = {
  plus: 'M12 5v14M5 12h14',
  minus: 'M5 12h14',
  fit: 'M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5',
  north: 'M12 3l6 17-6-4-6 4z',
  check: 'M5 12.5l4.5 4.5L19 7',
  cross: 'M6 6l12 12M18 6L6 18',
  question: 'M8.5 9a3.5 3.5 0 1 1 5 3.2c-1 .5-1.5 1.2-1.5 2.3M12 18.4v.1',
  warning: 'M12 4L2.5 20h19zM12 10v5M12 17.6v.1',
  info: 'M12 11v6M12 7.4v.1M12 21a9 9 0 1 0 0-18 9 9 0 0 0 0 18z',
  battery: 'M3 8h15v8H3zM18 10.5h2.5v3H18',
  satellite: 'M5 19a9 9 0 0 1 0-13M8 16a5 5 0 0 1 0-7M11 12.5h.1M12 12l7-7M15 4l5 5',
  height: 'M12 4v16M8 8l4-4 4 4M5 20h14',
  link: 'M4 18v-3M9 18v-6M14 18V9M19 18V5',
  clock: 'M12 7v5l3.5 2M12 21a9 9 0 1 0 0-18 9 9 0 0 0 0 18z',
  camera: 'M4 8h3.5L9 6h6l1.5 2H20v11H4zM12 16.5a3.2 3.2 0 1 0 0-6.4 3.2 3.2 0 0 0 0 6.4z',
  target: 'M12 19a7 7 0 1 0 0-14 7 7 0 0 0 0 14zM12 2v5M12 17v5M2 12h5M17 12h5',
  sun: 'M12 16.5a4.5 4.5 0 1 0 0-9 4.5 4.5 0 0 0 0 9zM12 2v2.5M12 19.5V22M2 12h2.5M19.5 12H22M5 5l1.7 1.7M17.3 17.3L19 19M5 19l1.7-1.7M17.3 6.7L19 5',
  moon: 'M20 14.5A8.5 8.5 0 0 1 9.5 4a8.5 8.5 0 1 0 10.5 10.5z',
  auto: 'M12 20.5a8.5 8.5 0 1 0 0-17 8.5 8.5 0 0 0 0 17zM12 3.5v17M12 8h4.5M12 12h6M12 16h4.5',
  person: 'M12 12a4 4 0 1 0 0-8 4 4 0 0 0 0 8zM4.5 20c.8-4 3.800-5.500 7.500-5.500s6.700 1.500 7.500 5.500',
  chevron: 'M8 10l4 4 4-4',
  wave: 'M3 13c3 0 3-3 6-3s3 3 6 3 3-3 6-3',
} as const;

export type IconName = keyof typeof PATHS;

export function Icon({ name, size = 20 }: { name: IconName; size?: number }) {
  return (
    <svg class="icon" width={size} height={size} viewBox="0 0 24 24" aria-hidden="true" focusable="false">
      <path d={PATHS[name]} />
    </svg>
  );
}
