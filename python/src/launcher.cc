// The command `bslam` of the Python package: starts the program in the folder of the package, which finds its libraries
// relative to itself. It is a native program, to avoid the start-up time of Python.
#include <glob.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace {

// The installation prefix, such as the folder of a virtual environment: the parent of the directory of this executable.
std::string prefix() {
  char path[PATH_MAX];
  const ssize_t length = readlink("/proc/self/exe", path, sizeof path);
  std::string out(path, length > 0 ? static_cast<std::size_t>(length) : 0);
  for (int level = 0; level < 2; ++level)
    out.resize(out.find_last_of('/') == std::string::npos ? 0 : out.find_last_of('/'));
  return out;
}

// The path of the interpreter of this installation: the one beside the command, or that of PATH.
std::string interpreter(const std::string& root) {
  std::string folders = root + "/bin:";
  if (const char* const path = std::getenv("PATH"); path != nullptr) folders += path;
  for (std::size_t begin = 0; begin <= folders.size();) {
    const std::size_t end = std::min(folders.find(':', begin), folders.size());
    const std::string file = folders.substr(begin, end - begin) + "/python3";
    if (access(file.c_str(), X_OK) == 0) return file;
    begin = end + 1;
  }
  return {};
}

// Resolves symbolic links and returns the name of the file, such as python3.11. The site-packages directory of this
// interpreter is inside a directory of the same name.
std::string real_name(const std::string& file) {
  char path[PATH_MAX];
  const std::string out = realpath(file.c_str(), path) != nullptr ? path : "";
  return out.substr(out.find_last_of('/') + 1);
}

// The text as a pattern that matches itself only.
std::string literal(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (std::strchr("*?[]\\", c) != nullptr) out += '\\';
    out += c;
  }
  return out;
}

// The programs of all packages below the prefix.
std::vector<std::string> programs(const std::string& root) {
  std::vector<std::string> out;
  for (const char* packages :
       {"/lib*/python3*/site-packages", "/lib*/python3*/dist-packages", "/local/lib*/python3*/dist-packages", ""}) {
    glob_t found{};
    if (glob((literal(root) + packages + "/bslam/bin/bslam").c_str(), 0, nullptr, &found) == 0)
      out.insert(out.end(), found.gl_pathv, found.gl_pathv + found.gl_pathc);
    globfree(&found);
  }
  return out;
}

}  // namespace

int main(int, char** argv) {
  const std::string root = prefix();
  const std::string python = interpreter(root), version = "/" + real_name(python) + "/";
  // The program needs this interpreter for --rerun. After pip install --user there is no interpreter beside the
  // command: the program then uses python3 from PATH.
  if (python.starts_with(root + "/bin/")) setenv("BSLAM_PYTHON", python.c_str(), 0);
  std::vector<std::string> found = programs(root);
  std::stable_partition(found.begin(), found.end(),
                        [&](const std::string& p) { return p.find(version) != std::string::npos; });
  for (const std::string& program : found) execv(program.c_str(), argv);
  std::fprintf(stderr, "bslam: cannot find the Python package below %s\n", root.c_str());
  return 1;
}
