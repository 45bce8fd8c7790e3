import "./style.css";
import { applyTheme, Explorer } from "./page/explorer.ts";
import { SiteSource } from "./page/file_source.ts";
import { SERVICE } from "./page/loader.ts";

applyTheme(matchMedia("(prefers-color-scheme: light)").matches);
// `veselova explore --export` marks a page without a server.
new Explorer("site" in document.documentElement.dataset ? new SiteSource() : SERVICE);
