"use strict";
(() => {
  const root = document.documentElement;
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];
  const press = (button, on) => button.setAttribute("aria-pressed", String(on));
  root.classList.add("js");

  // Light and dark: the button offers what is not shown.
  const theme = document.querySelector("button.theme");
  if (theme) {
    const preferred = matchMedia("(prefers-color-scheme: dark)");
    const isDark = () => root.dataset.theme ? root.dataset.theme === "dark" : preferred.matches;
    const label = () => { theme.textContent = isDark() ? "Light" : "Dark"; };
    theme.hidden = false;
    theme.addEventListener("click", () => { root.dataset.theme = isDark() ? "light" : "dark"; label(); });
    preferred.addEventListener("change", label);
    label();
  }

  // Alternatives: a choice holds wherever it is offered.
  const choose = (name) => {
    for (const block of all(".alternatives")) {
      const names = all(":scope > .alternative", block).map((a) => a.dataset.name);
      const chosen = names.includes(name) ? name : block.dataset.chosen || names[0];
      block.dataset.chosen = chosen;
      for (const a of all(":scope > .alternative", block)) a.classList.toggle("chosen", a.dataset.name === chosen);
      for (const b of all(":scope > .choices > button", block)) press(b, b.dataset.choice === chosen);
    }
  };
  choose(undefined);
  for (const button of all(".choices > button")) button.addEventListener("click", () => choose(button.dataset.choice));

  // Legends: pressed entries stand out from the other curves of their section.
  for (const button of all(".legend button")) {
    button.addEventListener("click", () => {
      const section = button.closest("section") || document;
      const on = button.getAttribute("aria-pressed") !== "true";
      for (const same of all(".legend button", section)) {
        if (same.dataset.series === button.dataset.series) press(same, on);
      }
      const chosen = new Set(all('.legend button[aria-pressed="true"]', section).map((b) => b.dataset.series));
      for (const group of all("g.one", section)) {
        group.classList.toggle("dim", chosen.size > 0 && !chosen.has(group.dataset.series));
      }
    });
  }

  // Galleries: one zoom and one position for all pictures.
  for (const gallery of all(".gallery")) {
    const width = Number(gallery.dataset.width);
    let zoom = 1, x = 0, y = 0;
    const readout = gallery.querySelector(".readout");
    const show = () => {
      const limit = 1 - 1 / zoom;
      x = Math.min(Math.max(x, 0), limit);
      y = Math.min(Math.max(y, 0), limit);
      gallery.style.setProperty("--zoom", zoom);
      gallery.style.setProperty("--x", x);
      gallery.style.setProperty("--y", y);
      gallery.classList.toggle("zoomed", zoom > 1);
      const view = all(".view", gallery).find((v) => v.clientWidth > 0);
      const scale = view ? view.clientWidth * zoom * devicePixelRatio / width : zoom;
      gallery.classList.toggle("crisp", scale > 1.5);
      if (readout) readout.textContent = zoom === 1 ? "" : zoom.toFixed(zoom < 10 ? 1 : 0) + " ×";
    };
    // Keeps the point at (u, v) of a view, as fractions, where it is.
    const zoomTo = (wanted, u = 0.5, v = 0.5) => {
      const next = Math.min(Math.max(wanted, 1), 64);
      x += u / zoom - u / next;
      y += v / zoom - v / next;
      zoom = next;
      show();
    };
    const place = (view, event) => {
      const box = view.getBoundingClientRect();
      return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    };

    for (const view of all(".view", gallery)) {
      const pointers = new Map();
      let moved = 0;
      const pinch = () => {
        const [a, b] = [...pointers.values()];
        return { distance: Math.hypot(a[0] - b[0], a[1] - b[1]), u: (a[0] + b[0]) / 2, v: (a[1] + b[1]) / 2 };
      };
      view.addEventListener("pointerdown", (event) => {
        if (event.button > 0) return;
        if (pointers.size === 0) moved = 0;
        pointers.set(event.pointerId, place(view, event));
        if (zoom > 1 || pointers.size > 1) view.setPointerCapture(event.pointerId);
      });
      view.addEventListener("pointermove", (event) => {
        const from = pointers.get(event.pointerId);
        if (!from) return;
        const to = place(view, event);
        const before = pointers.size === 2 ? pinch() : null;
        pointers.set(event.pointerId, to);
        moved += Math.abs(to[0] - from[0]) + Math.abs(to[1] - from[1]);
        if (before) {
          const after = pinch();
          x -= (after.u - before.u) / zoom;
          y -= (after.v - before.v) / zoom;
          zoomTo(zoom * after.distance / Math.max(before.distance, 1e-3), after.u, after.v);
        } else if (zoom > 1) {
          x -= (to[0] - from[0]) / zoom;
          y -= (to[1] - from[1]) / zoom;
          show();
        }
      });
      const release = (event) => {
        const tapped = event.type === "pointerup" && pointers.size === 1 && moved < 0.01;
        if (pointers.delete(event.pointerId) && tapped) zoomTo(event.shiftKey ? zoom / 2 : zoom * 2, ...place(view, event));
      };
      view.addEventListener("pointerup", release);
      view.addEventListener("pointercancel", release);
      // Plain scrolling stays with the page.
      view.addEventListener("wheel", (event) => {
        if (!event.ctrlKey && !event.metaKey) return;
        event.preventDefault();
        zoomTo(zoom * Math.exp(-event.deltaY * 0.01), ...place(view, event));
      }, { passive: false });
      view.addEventListener("keydown", (event) => {
        const step = 0.1 / zoom;
        const actions = {
          "+": () => zoomTo(zoom * 2), "=": () => zoomTo(zoom * 2), "-": () => zoomTo(zoom / 2), "0": () => zoomTo(1),
          ArrowLeft: () => { x -= step; show(); }, ArrowRight: () => { x += step; show(); },
          ArrowUp: () => { y -= step; show(); }, ArrowDown: () => { y += step; show(); },
        };
        const isArrow = event.key.startsWith("Arrow");
        if (!actions[event.key] || event.ctrlKey || event.metaKey || (isArrow && zoom === 1)) return;
        event.preventDefault();
        actions[event.key]();
      });
    }
    for (const button of all("[data-zoom]", gallery)) {
      button.addEventListener("click", () => {
        const by = Number(button.dataset.zoom);
        zoomTo(by === 0 ? 1 : zoom * by);
      });
    }

    // Layers: what each frame shows; one that has no such layer shows its first.
    const frames = all(".frames .view", gallery);
    const wipe = gallery.querySelector(".wipe");
    const sides = wipe ? all("select", wipe) : [];
    const showWipe = () => {
      all("img", wipe).forEach((img, side) => {
        const frame = frames[Number(sides[side].value)];
        const shown = frame && frame.querySelector("img.shown");
        if (shown) { img.src = shown.src; img.alt = shown.alt; img.classList.add("shown"); }
      });
    };
    const showLayer = (name) => {
      for (const view of frames) {
        const layers = all("img", view);
        const wanted = layers.find((img) => img.dataset.layer === name) || layers[0];
        for (const img of layers) img.classList.toggle("shown", img === wanted);
      }
      for (const button of all("[data-show]", gallery)) press(button, button.dataset.show === name);
      for (const key of all("[data-key]", gallery)) key.hidden = key.dataset.key !== name;
      if (wipe) showWipe();
    };
    for (const button of all("[data-show]", gallery)) button.addEventListener("click", () => showLayer(button.dataset.show));
    if (wipe) {
      for (const select of sides) select.addEventListener("change", showWipe);
      const slider = wipe.querySelector("input");
      const cut = () => wipe.style.setProperty("--cut", slider.value + "%");
      slider.addEventListener("input", cut);
      cut();
    }
    showLayer(gallery.dataset.first);
    show();
    addEventListener("resize", show);
  }
})();
