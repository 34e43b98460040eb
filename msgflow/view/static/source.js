// Where pages get their data: from the server that sent them, or from the file that they are in.

import { decode } from "./columns.js";

export class SourceError extends Error {
  constructor(message, hint, code) {
    super(message);
    this.hint = hint;
    this.code = code;
  }
}

export class ServedSource {
  constructor() {
    this.isServed = true;
    this.notes = [];
    this.kept = new Map();
    this.generation = document.documentElement.dataset.generation ?? "";
  }

  async fetch(name, params = {}, signal = undefined) {
    const query = new URLSearchParams();
    for (const [key, value] of Object.entries(params)) {
      if (value !== null && value !== undefined) query.set(key, value);
    }
    const address = `api/${name}?${query}`;
    if (this.kept.has(address)) return this.kept.get(address);
    let answer;
    try {
      answer = await fetch(address, { signal, headers: { "X-Generation": this.generation } });
    } catch (error) {
      if (error.name === "AbortError") throw error;
      throw new SourceError("the server does not answer", "is msgflow ui still running?", "gone");
    }
    if (!answer.ok) {
      const said = await answer.json().catch(() => ({}));
      throw new SourceError(said.error ?? answer.statusText, said.hint, said.code);
    }
    const table = decode(new Uint8Array(await answer.arrayBuffer()));
    this.kept.set(address, table);
    if (this.kept.size > 60) this.kept.delete(this.kept.keys().next().value);
    return table;
  }
}
