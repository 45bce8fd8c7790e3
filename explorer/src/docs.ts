/** The page at /docs: the contract of the HTTP API, and each request to try. */
import SwaggerUI from "swagger-ui-dist/swagger-ui-es-bundle.js";
import "swagger-ui-dist/swagger-ui.css";

SwaggerUI({
  url: "openapi.json",
  dom_id: "#api",
  deepLinking: true,
  // Nothing is asked of a validator in the network.
  validatorUrl: null,
});
