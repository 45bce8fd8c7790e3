/** The page of one motion as one file: the same sources, with everything inside. */
import { resolve } from "node:path";
import { defineConfig, mergeConfig } from "vite";
import type { Plugin } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";
import page from "./vite.config.ts";

/** Its page is index.html, with a place for the motion and a start of its own. */
const carriesMotion: Plugin = {
  name: "carries-motion",
  transformIndexHtml: {
    order: "pre",
    handler(html) {
      const own = '<script type="module" src="/src/main.ts"></script>';
      if (!html.includes(own)) throw new Error("index.html starts by another script");
      return html.replace(
        own,
        '<script type="application/json" id="motion">null</script>\n    ' +
          '<script type="module" src="/src/file.ts"></script>',
      );
    },
  },
};

const { build, ...shared } = page;
const { rolldownOptions: _, ...built } = build ?? {};

export default mergeConfig(
  { ...shared, build: built },
  defineConfig({
    plugins: [carriesMotion, viteSingleFile({ removeViteModuleLoader: true })],
    resolve: {
      alias: [
        {
          find: /^.*\/worker\.ts\?worker$/,
          replacement: `${resolve(import.meta.dirname, "src/worker.ts")}?worker&inline`,
        },
      ],
    },
    // A page without an origin may start no module as a thread.
    worker: { format: "iife" },
    build: { outDir: resolve(process.env.EXPLORER_OUTPUT ?? "dist", "file") },
  }),
);
