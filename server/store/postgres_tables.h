#pragma once

// What weftd makes in a database: the statements that lead from each version to the next.
namespace weft::postgres {

inline constexpr const char* kVersions[] = {R"(
  -- a weftd that serves, or did
  CREATE TABLE weft.replica (
    number BIGINT PRIMARY KEY,
    name TEXT NOT NULL,
    pid INT NOT NULL,                     -- of the connection that it renews its lease by
    backend_start TIMESTAMPTZ,            -- of that
    renewed TIMESTAMPTZ NOT NULL,
    lease_until TIMESTAMPTZ NOT NULL,
    since TIMESTAMPTZ NOT NULL);          -- it has held leases without a gap
  CREATE SEQUENCE weft.replica_number;
  CREATE TABLE weft.session (
    uid TEXT PRIMARY KEY,
    id TEXT NOT NULL UNIQUE,
    principal TEXT NOT NULL,
    owner BIGINT NOT NULL,                -- number of the replica that has it; 0: none
    epoch BIGINT NOT NULL,                -- one more with each owner; every write names its own
    progress BYTEA NOT NULL,              -- weft.storage.v1.KeptProgress
    checksum BIGINT NOT NULL              -- CRC-32 of uid and progress
  ) WITH (fillfactor = 60);
  CREATE INDEX ON weft.session (owner);
  CREATE TABLE weft.scene (
    uid TEXT PRIMARY KEY REFERENCES weft.session ON DELETE CASCADE,
    record BYTEA NOT NULL,                -- weft.storage.v1.KeptSession
    checksum BIGINT NOT NULL);            -- CRC-32 of uid and record
  CREATE TABLE weft.entry (
    uid TEXT REFERENCES weft.session ON DELETE CASCADE,
    number BIGINT,                        -- 0, 1, 2 ... within its session
    record BYTEA NOT NULL,                -- weft.storage.v1.LogEntry
    checksum BIGINT NOT NULL,             -- CRC-32 of uid, number and record
    PRIMARY KEY (uid, number));
  CREATE TABLE weft.snapshot (
    uid TEXT REFERENCES weft.session ON DELETE CASCADE,
    name TEXT,
    content BYTEA NOT NULL,               -- weft.storage.v1.KeptSnapshot with its checksum
    PRIMARY KEY (uid, name));
  ALTER TABLE weft.snapshot ALTER COLUMN content SET STORAGE EXTERNAL;
  CREATE TABLE weft.request (
    id TEXT PRIMARY KEY,
    checksum BIGINT NOT NULL,             -- of the call
    uid TEXT NOT NULL,
    carried_out TIMESTAMPTZ NOT NULL DEFAULT now());
  CREATE INDEX ON weft.request (carried_out);

  -- Whether sessions of `holder` are not to be taken over by `asker`: it neither left nor lost its
  -- connection, and its lease runs. Where the database itself was away, leases ran out through no
  -- fault of their holders; they come first when it is back, since the asker's gap is as young.
  CREATE FUNCTION weft.holds(holder BIGINT, asker BIGINT) RETURNS BOOLEAN LANGUAGE sql STABLE AS $$
    SELECT EXISTS (
      SELECT FROM weft.replica h WHERE h.number = holder AND CASE
        WHEN h.renewed > pg_postmaster_start_time() AND NOT EXISTS (
          SELECT FROM pg_stat_activity a
          WHERE a.pid = h.pid AND (a.backend_start = h.backend_start) IS NOT FALSE) THEN false
        WHEN h.lease_until > now() THEN true
        ELSE coalesce((SELECT a.since > now() - INTERVAL '2 s'
                       FROM weft.replica a WHERE a.number = asker), true)
      END)
  $$;
)",
                                            R"(
  -- a large value that sessions name, whole or not
  CREATE TABLE weft.asset (
    hash TEXT COLLATE "C",                -- SHA-256 of the bytes, 64 hexadecimal digits
    principal TEXT COLLATE "C",           -- whose it is
    size BIGINT NOT NULL,                 -- bytes in all
    received BIGINT NOT NULL,             -- bytes that are there
    content TEXT NOT NULL,                -- of the pieces
    made BIGINT NOT NULL,                 -- when it became whole, us since 1970; 0: it is not
    facts BYTEA NOT NULL,                 -- weft.v1.MeshFacts of a whole one
    unused_since BIGINT NOT NULL,         -- us since 1970
    PRIMARY KEY (hash, principal));
  CREATE INDEX ON weft.asset (content);
  CREATE TABLE weft.asset_piece (
    content TEXT,
    number BIGINT,                        -- 0, 1, 2 ... of 1 MiB each but the last
    data BYTEA NOT NULL,
    PRIMARY KEY (content, number));
  ALTER TABLE weft.asset_piece ALTER COLUMN data SET STORAGE EXTERNAL;
  CREATE TABLE weft.asset_use (
    uid TEXT REFERENCES weft.session ON DELETE CASCADE,
    hash TEXT COLLATE "C",
    principal TEXT COLLATE "C",           -- whose session it is
    PRIMARY KEY (uid, hash),
    FOREIGN KEY (hash, principal) REFERENCES weft.asset);
  CREATE INDEX ON weft.asset_use (hash, principal);
)"};

}  // namespace weft::postgres
