import type { ComponentChildren } from 'preact';
import { useId } from 'preact/hooks';

export interface PanelProps {
  title: string;
  /** Beside the title, at the right. */
  aside?: ComponentChildren;
  class?: string;
  testid?: string;
  children: ComponentChildren;
}

/** A titled region of the page. */
export function Panel({ title, aside, class: more = '', testid, children }: PanelProps) {
  const id = useId();
  return (
    <section class={`panel ${more}`} aria-labelledby={id} data-testid={testid}>
      <header class="panel-head">
        <h2 id={id}>{title}</h2>
        {aside}
      </header>
      {children}
    </section>
  );
}
