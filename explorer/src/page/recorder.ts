/** A film of a view as the page draws it: WebM, by the browser's own recorder. */

/** Pictures a second, and the seconds after which a film ends by itself. */
const PICTURES = 30;
const LONGEST_S = 60;

/** Milliseconds between the parts in which a film comes. */
const PART_MS = 100;

const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];

export interface Recording {
  /** End the film, once it has a picture. */
  stop: () => void;
  /** The film, once it has ended. */
  film: Promise<Blob>;
}

/** Return the kind of films that this browser records; null for one that records none. */
export function filmType(): string | null {
  if (typeof MediaRecorder === "undefined") return null;
  return TYPES.find((type) => MediaRecorder.isTypeSupported(type)) ?? null;
}

/** Begin to record a canvas. */
export function record(canvas: HTMLCanvasElement, type: string): Recording {
  const recorder = new MediaRecorder(canvas.captureStream(PICTURES), {
    mimeType: type,
    videoBitsPerSecond: 6e6,
  });
  const parts: Blob[] = [];
  let ending = false;
  const film = new Promise<Blob>((resolve, reject) => {
    recorder.ondataavailable = ({ data }) => {
      parts.push(data);
      // A recorder that is stopped before its first picture gives a file that nothing plays.
      if (ending && data.size > 0 && recorder.state !== "inactive") recorder.stop();
    };
    recorder.onstop = () => resolve(new Blob(parts, { type: "video/webm" }));
    recorder.onerror = () => reject(new Error("The browser stopped the film."));
  });
  const stop = () => {
    clearTimeout(timer);
    ending = true;
  };
  const timer = setTimeout(stop, 1000 * LONGEST_S);
  recorder.start(PART_MS);
  return { stop, film };
}
