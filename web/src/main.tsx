import { render } from 'preact';
import { App } from './app';
import { start } from './state/store';
import './styles/tokens.css';
import './styles/base.css';
import './styles/layout.css';
import './styles/panels.css';
import './styles/mission.css';
import './styles/map.css';
import './styles/narrow.css';

const root = document.getElementById('app');
if (root !== null) {
  const retry = start();
  render(<App retry={retry} />, root);
}
