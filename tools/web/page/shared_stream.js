// The worker of stream.js: one connection to the server for all tabs of a browser.
import { connect } from './stream.js';

const tabs = new Set();
const stream = connect((...event) => tabs.forEach((tab) => tab.postMessage(event)));

self.onconnect = ({ ports: [tab] }) => {
  tab.onmessage = ({ data: enters }) => {
    if (enters) {
      tabs.add(tab);
      // The new tab needs a snapshot; to the others it says nothing new.
      stream.open();
    } else if (tabs.delete(tab) && tabs.size === 0) {
      stream.close();
    }
  };
};
