// The command `bslam` of the Python package: starts the program in the folder of the package, which finds its libraries
// relative to itself. Written without the interpreter, so that it takes no time.
#include <glob.h>
#include <unistd.h>

#include <climits>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace {

// The folder that contains the folder of this command, such as that of a virtual environment.
std::string prefix() {
  char path[PATH_MAX];
  const ssize_t length = readlink("/proc/self/exe", path, sizeof path);
  std::string out(path, length > 0 ? static_cast<std::size_t>(length) : 0);
  for (int level = 0; level < 2; ++level)
    out.resize(out.find_last_of('/') == std::string::npos ? 0 : out.find_last_of('/'));
  return out;
}

}  // namespace

int main(int, char** argv) {
  const std::string root = prefix();
  // For --rerun. There is none beside commands that were installed with pip --user: python3 of PATH is used then.
  const std::string python = root + "/bin/python3";
  if (access(python.c_str(), X_OK) == 0) setenv("BSLAM_PYTHON", python.c_str(), 0);
  for (const char* packages :
       {"/lib*/python3*/site-packages", "/lib*/python3*/dist-packages", "/local/lib*/python3*/dist-packages", ""}) {
    glob_t found{};
    if (glob((root + packages + "/bslam/bin/bslam").c_str(), 0, nullptr, &found) == 0) {
      execv(found.gl_pathv[found.gl_pathc - 1], argv);
    }
    globfree(&found);
  }
  std::fprintf(stderr, "bslam: cannot find the Python package below %s\n", root.c_str());
  return 1;
}
