/** Panels of which one is seen, by the pattern of the ARIA authoring practices. */

import { h } from "./dom";

export class Tabs {
  readonly element: HTMLElement;
  private readonly buttons: HTMLButtonElement[];

  constructor(private readonly panels: [string, string, HTMLElement][], private readonly seen: (name: string) => void) {
    this.buttons = panels.map(([name, label], index) =>
      h("button", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": `panel-${name}`, onclick: () => this.choose(index) }, label));
    const list = h("div", { role: "tablist", class: "tabs", "aria-label": "what is looked at", onkeydown: (event: KeyboardEvent) => this.key(event) }, ...this.buttons);
    this.element = h("div", { class: "tabbed" }, list,
      ...panels.map(([name, , panel]) => h("div", { role: "tabpanel", id: `panel-${name}`, "aria-labelledby": `tab-${name}`, tabindex: 0 }, panel)));
    const kept = panels.findIndex(([name]) => name === sessionStorage.getItem("tab"));
    this.choose(Math.max(0, kept));
  }

  /** Shows a panel. */
  open(name: string): void {
    this.choose(Math.max(0, this.panels.findIndex(([one]) => one === name)));
  }

  private choose(chosen: number): void {
    this.buttons.forEach((button, index) => {
      const is_chosen = index === chosen;
      button.setAttribute("aria-selected", String(is_chosen));
      button.tabIndex = is_chosen ? 0 : -1;
      const panel = this.element.children[index + 1] as HTMLElement;
      panel.hidden = !is_chosen;
    });
    const [name] = this.panels[chosen]!;
    sessionStorage.setItem("tab", name);
    this.seen(name);
  }

  private key(event: KeyboardEvent): void {
    const at = this.buttons.indexOf(document.activeElement as HTMLButtonElement);
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: this.buttons.length - 1 }[event.key];
    if (to === undefined || at < 0) return;
    event.preventDefault();
    const next = (to + this.buttons.length) % this.buttons.length;
    this.choose(next);
    this.buttons[next]!.focus();
  }
}
