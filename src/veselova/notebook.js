// The page in a frame, and both ways between its time and the widget's.
const NAMES = ["t", "speed", "playing"];
export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.setAttribute("sandbox", "allow-scripts allow-downloads");
    frame.title = model.get("title");
    frame.style.width = "100%";
    frame.style.border = "0";
    const resize = () => (frame.style.height = `${model.get("height")}px`);
    resize();
    let heard = false;
    const hear = ({ source, data }) => {
      if (source !== frame.contentWindow || !data?.veselova) return;
      heard = true;
      for (const name of NAMES) model.set(name, data.veselova[name]);
      model.save_changes();
      heard = false;
    };
    const tell = NAMES.map((name) => [`change:${name}`, () => {
      if (heard) return;
      frame.contentWindow?.postMessage({ veselova: { [name]: model.get(name) } }, "*");
    }]);
    window.addEventListener("message", hear);
    model.on("change:height", resize);
    for (const [event, act] of tell) model.on(event, act);
    frame.srcdoc = model.get("page");
    el.append(frame);
    return () => {
      window.removeEventListener("message", hear);
      model.off("change:height", resize);
      for (const [event, act] of tell) model.off(event, act);
    };
  },
};
