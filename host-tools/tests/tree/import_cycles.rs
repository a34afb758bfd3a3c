//! No module imports one that imports it: inside every folder of every crate, imports point one way.
//!
//! Modules side by side in one folder (a file, or a folder with all that is in it) must form a tree of imports. That a
//! module uses what its parent's own file defines, and the parent its children, is how Rust nests and is no cycle.
//! Tests inside the sources are not looked at.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use syn::visit::{self, Visit};

/// A module's path inside its crate.
type Module = Vec<String>;

/// What one file imports, and what it calls it.
#[derive(Default)]
struct File {
    /// Paths as written, `crate`, `self` and `super` included.
    paths: Vec<Vec<String>>,
    /// Imported names and their paths.
    names: BTreeMap<String, Vec<String>>,
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        syn::Meta::List(list) => list.path.is_ident("cfg") && list.tokens.to_string().contains("test"),
        _ => false,
    })
}

impl File {
    fn import(&mut self, tree: &syn::UseTree, mut before: Vec<String>) {
        match tree {
            syn::UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.import(&path.tree, before);
            }
            syn::UseTree::Group(group) => group.items.iter().for_each(|tree| self.import(tree, before.clone())),
            syn::UseTree::Glob(_) => self.paths.push(before),
            syn::UseTree::Name(syn::UseName { ident }) if ident == "self" => self.name(before.last().cloned(), before),
            syn::UseTree::Name(syn::UseName { ident }) => {
                before.push(ident.to_string());
                self.name(Some(ident.to_string()), before);
            }
            syn::UseTree::Rename(syn::UseRename { ident, rename, .. }) => {
                before.push(ident.to_string());
                self.name(Some(rename.to_string()), before);
            }
        }
    }

    fn name(&mut self, name: Option<String>, path: Vec<String>) {
        self.paths.push(path.clone());
        self.names.extend(name.map(|name| (name, path)));
    }
}

impl<'ast> Visit<'ast> for File {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        if !is_test(&item.attrs) {
            self.import(&item.tree, Vec::new());
        }
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.paths.push(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        visit::visit_path(self, path);
    }
}

/// The modules of a crate.
struct Crate(BTreeMap<Module, File>);

impl Crate {
    fn read(source: &Path) -> Self {
        let mut modules = BTreeMap::new();
        let mut folders = vec![(source.to_owned(), Module::new())];
        while let Some((folder, module)) = folders.pop() {
            for entry in std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()) {
                let stem = entry.file_stem().unwrap().to_string_lossy().into_owned();
                let below = [module.clone(), vec![stem.clone()]].concat();
                if entry.is_dir() && stem != "bin" {
                    folders.push((entry, below));
                } else if entry.extension().is_some_and(|extension| extension == "rs") && stem != "tests" {
                    let of_folder = ["lib", "main", "mod"].contains(&stem.as_str());
                    let text = std::fs::read_to_string(&entry).unwrap();
                    let syntax = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", entry.display()));
                    let file: &mut File = modules.entry(if of_folder { module.clone() } else { below }).or_default();
                    file.visit_file(&syntax);
                }
            }
        }
        Self(modules)
    }

    /// The module that defines what a path, as written in a module, leads to.
    fn target(&self, from: &Module, path: &[String], depth: usize) -> Option<Module> {
        let mut module = match path.first()?.as_str() {
            "crate" => Module::new(),
            "self" | "super" => from.clone(),
            child => [from.clone(), vec![child.to_owned()]].concat(),
        };
        if !self.0.contains_key(&module) {
            return None;
        }
        let mut rest = &path[1..];
        if path[0] == "super" {
            module.pop();
            while rest.first().is_some_and(|segment| segment == "super") {
                (_, rest) = (module.pop(), &rest[1..]);
            }
        }
        for (at, segment) in rest.iter().enumerate() {
            let below = [module.clone(), vec![segment.clone()]].concat();
            if self.0.contains_key(&below) {
                module = below;
            } else {
                let renamed = self.0.get(&module)?.names.get(segment).filter(|_| depth < 8);
                let onward = renamed.map(|renamed| [renamed.clone(), rest[at + 1..].to_vec()].concat());
                return onward.and_then(|onward| self.target(&module, &onward, depth + 1)).or(Some(module));
            }
        }
        Some(module)
    }

    /// Imports between modules side by side, by the folder that they stand in.
    fn imports(&self) -> BTreeMap<Module, BTreeMap<&str, BTreeSet<String>>> {
        let mut imports: BTreeMap<Module, BTreeMap<&str, BTreeSet<String>>> = BTreeMap::new();
        for (from, file) in &self.0 {
            for to in file.paths.iter().filter_map(|path| self.target(from, path, 0)) {
                let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
                if let (Some(user), Some(used)) = (from.get(common), to.get(common)) {
                    imports.entry(from[..common].to_vec()).or_default().entry(user).or_default().insert(used.clone());
                }
            }
        }
        imports
    }
}

/// Groups of modules that import each other, directly or over others.
fn cycles(imports: &BTreeMap<&str, BTreeSet<String>>) -> BTreeSet<Vec<String>> {
    let reach = |start: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start.to_owned()]);
        while let Some(module) = open.pop() {
            let next = imports.get(module.as_str()).into_iter().flatten();
            open.extend(next.filter(|next| seen.insert((*next).clone())).cloned());
        }
        seen
    };
    let reached: BTreeMap<&str, BTreeSet<String>> = imports.keys().map(|module| (*module, reach(module))).collect();
    let both = |a: &str, b: &str| reached[a].contains(b) && reached.get(b).is_some_and(|of| of.contains(a));
    let in_cycle = reached.keys().filter(|module| both(module, module));
    in_cycle.map(|a| reached.keys().filter(|b| both(a, b)).map(|b| (*b).to_owned()).collect()).collect()
}

#[test]
fn imports_point_one_way() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let manifest: toml::Table = std::fs::read_to_string(root.join("Cargo.toml")).unwrap().parse().unwrap();
    let members = manifest["workspace"]["members"].as_array().unwrap().iter().map(|member| member.as_str().unwrap());
    let mut found = BTreeSet::new();
    for member in members.filter(|member| root.join(member).join("src").is_dir()) {
        for (folder, imports) in Crate::read(&root.join(member).join("src")).imports() {
            let modules = cycles(&imports);
            found.extend(modules.into_iter().map(|modules| (member.to_owned(), folder.join("/"), modules)));
        }
    }
    assert!(found.is_empty(), "modules that import each other: {found:#?}");
}

#[test]
fn a_cycle_is_seen_through_a_re_export_and_a_tree_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("lib.rs", "mod a; mod b; mod c; pub use b::Thing; pub struct Own;");
    write("a.rs", "use crate::Thing; use crate::Own; use crate::c::{self, Deep};");
    write("b.rs", "use super::c::Deep; #[cfg(test)] mod tests { use crate::a; }");
    write("c.rs", "pub struct Deep;");
    let of_root = || Crate::read(folder.path()).imports().remove(&Module::new()).map(|i| cycles(&i)).unwrap();
    assert!(of_root().is_empty(), "{:?}", of_root());
    write("c.rs", "fn uses() { crate::a::anything(); }");
    assert_eq!(of_root(), [["a", "b", "c"].map(str::to_owned).to_vec()].into());
}
