import { defineConfig } from "vite";
import type { Plugin } from "vite";

/** Every browser that runs the page reads woff2: the older forms of KaTeX's fonts are left out. */
const newFontsOnly: Plugin = {
  name: "new-fonts-only",
  enforce: "pre",
  transform(code, id) {
    if (!id.endsWith("katex.min.css")) return null;
    return code.replace(/,url\([^)]*\.(?:woff|ttf)\) format\("[^"]*"\)/g, "");
  },
};

export default defineConfig({
  base: "./",
  plugins: [newFontsOnly],
  build: {
    rolldownOptions: { input: ["index.html", "geodesics.html", "docs.html"] },
    outDir: process.env.EXPLORER_OUTPUT ?? "dist",
    emptyOutDir: true,
    assetsDir: "explorer",
    // Everything is a file of its own: the policy of the page allows no data in addresses but images.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    target: "es2022",
    chunkSizeWarningLimit: 800,
  },
  worker: { format: "es" },
});
