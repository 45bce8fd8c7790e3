import "./style.css";
import { Explorer } from "./page/explorer.ts";
import { SiteSource } from "./page/file_source.ts";
import { SERVICE } from "./page/loader.ts";

// `veselova explore --export` marks a page without a server.
new Explorer("site" in document.documentElement.dataset ? new SiteSource() : SERVICE);
