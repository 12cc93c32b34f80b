/** Services by kind, the worst state first. Pure. */
import type { Service } from '../../api/types';

export type ServiceTone = 'ok' | 'warn' | 'bad' | 'idle';

export interface ServiceGroup {
  service: string;
  tone: ServiceTone;
  instances: Service[];
}

const RANK: Record<ServiceTone, number> = { bad: 0, warn: 1, idle: 2, ok: 3 };

/** Without a live link nothing is known of any service. */
export function serviceTone(service: Service, live: boolean): ServiceTone {
  if (!live) return 'idle';
  if (service.stale || service.state === 'restarting') return 'bad';
  return service.state === 'ready' ? 'ok' : 'warn';
}

export function groupServices(services: readonly Service[], live: boolean): ServiceGroup[] {
  const groups = new Map<string, Service[]>();
  for (const one of services) groups.set(one.service, [...(groups.get(one.service) ?? []), one]);
  return [...groups]
    .map(([service, instances]) => ({
      service,
      instances: instances.toSorted((a, b) => a.instance.localeCompare(b.instance, 'en', { numeric: true })),
      tone: instances.map((one) => serviceTone(one, live)).reduce((worst, tone) => (RANK[tone] < RANK[worst] ? tone : worst), 'ok' as ServiceTone),
    }))
    .toSorted((a, b) => RANK[a.tone] - RANK[b.tone] || a.service.localeCompare(b.service, 'en'));
}
