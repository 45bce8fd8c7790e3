"""The contract of HTTP: models of requests, JSON documents, problem documents, media types,
settings.
"""
