//! Who may ask: protection against DNS rebinding and against other web pages using a person's browser to command the fleet.
//!
//! A page elsewhere can let its own host name point at this address, or post here from its own origin; the browser then tells
//! on it by `Host` and `Origin`. Programs that send no `Origin` are not browsers and are let through.

use std::net::IpAddr;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, Method, header};
use axum::middleware::Next;
use axum::response::Response;

use super::problem::ApiError;
use crate::app::App;

/// Middleware; see the module.
pub async fn layer(State(app): State<App>, request: Request, next: Next) -> Result<Response, ApiError> {
    let host = request
        .headers()
        .get(header::HOST)
        .and_then(|host| host.to_str().ok())
        .or_else(|| request.uri().authority().map(axum::http::uri::Authority::as_str))
        .ok_or_else(|| ApiError::BadRequest("the request has no Host".into()))?;
    if !host_allowed(host, app.loopback, &app.config.allowed_hosts) {
        return Err(ApiError::Forbidden(format!(
            "this gateway does not go by the name {:?}; add it to [gateway] allowed_hosts if it should",
            name_of(host).chars().take(100).collect::<String>()
        )));
    }
    let safe = matches!(*request.method(), Method::GET | Method::HEAD | Method::OPTIONS);
    let upgrade = request.headers().contains_key(header::UPGRADE);
    if (!safe || upgrade) && !origin_allowed(request.headers(), host) {
        return Err(ApiError::Forbidden("a web page of another origin may not command this fleet".into()));
    }
    Ok(next.run(request).await)
}

/// The host name of `name`, `name:port`, `[v6]` or `[v6]:port`.
fn name_of(host: &str) -> &str {
    if let Some(rest) = host.strip_prefix('[') {
        return rest.split(']').next().unwrap_or_default();
    }
    host.rsplit_once(':').map_or(host, |(name, _)| name)
}

/// Whether we go by the name in `host`.
///
/// On loopback: only this host's own names. Otherwise also plain addresses, names without a dot and `.local` names, which no
/// page on the internet can own. And always what the configuration lists.
fn host_allowed(host: &str, loopback: bool, listed: &[String]) -> bool {
    let name = name_of(host).trim_end_matches('.').to_ascii_lowercase();
    if name == "localhost" || name.ends_with(".localhost") || listed.iter().any(|listed| listed.eq_ignore_ascii_case(&name)) {
        return true;
    }
    match name.parse::<IpAddr>() {
        Ok(address) => !loopback || address.is_loopback(),
        Err(_) => !loopback && !name.is_empty() && (!name.contains('.') || name.ends_with(".local")),
    }
}

/// Whether the page that asks, if it is one, came from here.
fn origin_allowed(headers: &HeaderMap, host: &str) -> bool {
    match headers.get(header::ORIGIN).map(|origin| origin.to_str()) {
        None => true,
        Some(Err(_)) => false,
        Some(Ok(origin)) => {
            // `null` and other schemes have no authority to compare.
            let (authority, port) = match origin.split_once("://") {
                Some(("http", authority)) => (authority, ":80"),
                Some(("https", authority)) => (authority, ":443"),
                _ => return false,
            };
            let plain = |text: &str| text.strip_suffix(port).unwrap_or(text).to_ascii_lowercase();
            plain(authority) == plain(host)
        }
    }
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    #[test]
    fn a_rebound_name_is_refused() {
        for host in ["localhost", "localhost:8080", "127.0.0.1:8080", "[::1]:8080", "app.localhost:1", "LOCALHOST."] {
            assert!(host_allowed(host, true, &[]), "{host}");
        }
        for host in
            ["evil.example", "127.0.0.1.evil.example:8080", "192.168.1.5", "ground", "", "[::1", "localhost.evil.example"]
        {
            let loopback_v6 = host == "[::1";
            assert_eq!(host_allowed(host, true, &[]), loopback_v6, "{host}");
        }
        for (host, allowed) in [("192.168.1.5:80", true), ("ground", true), ("boat.local", true), ("evil.example", false)] {
            assert_eq!(host_allowed(host, false, &[]), allowed, "{host}");
        }
        assert!(host_allowed("fleet.example:8080", true, &["fleet.example".into()]));
    }

    #[test]
    fn another_page_is_refused() {
        #[track_caller]
        fn check(origin: &'static str, host: &str, allowed: bool) {
            let mut headers = HeaderMap::new();
            headers.insert(header::ORIGIN, HeaderValue::from_static(origin));
            assert_eq!(origin_allowed(&headers, host), allowed, "{origin} on {host}");
        }
        assert!(origin_allowed(&HeaderMap::new(), "localhost:8080"));
        check("http://localhost:8080", "localhost:8080", true);
        check("http://localhost", "localhost:80", true);
        check("https://fleet.example", "fleet.example", true);
        check("http://localhost:9999", "localhost:8080", false);
        check("http://evil.example", "localhost:8080", false);
        check("null", "localhost:8080", false);
        check("file://", "localhost:8080", false);
        check("http://localhost:80800", "localhost:8080", false);
    }
}
